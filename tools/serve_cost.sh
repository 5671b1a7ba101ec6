#!/bin/sh
# What it costs a training to be watched: steps a second alone, and with three watchers of which one stands still, in
# turns. Usage: tools/serve_cost.sh FMLGS PHOTOS [ROUNDS] [STEPS] [MAX_SIDE]; needs bash and Python.
set -eu
fmlgs=$1 photos=$2 rounds=${3:-5} steps=${4:-500} side=${5:-256}
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
train() {
    rm -rf "$folder/out"
    "$fmlgs" train "$photos" --out "$folder/out" --steps "$steps" --max-side "$side" --eval-every 0 \
        --checkpoint-secs 0 --json -q "$@"
}
rate() { python3 -c 'import json, sys; run = json.load(sys.stdin); print(run["steps"] / run["secs"])'; }
watched() {
    train --serve 127.0.0.1:0 2>"$folder/said" >"$folder/result" &
    training=$!
    until url=$(grep -o "http://[^']*" "$folder/said" | head -1) && [ -n "$url" ]; do
        kill -0 "$training" || { cat "$folder/said" >&2; exit 1; }
        sleep 0.1
    done
    nice -n 19 "$fmlgs" connect "$url" --headless -q >/dev/null 2>&1 &
    nice -n 19 "$fmlgs" connect "$url" --headless -q >/dev/null 2>&1 &
    # Asks for the Gaussians again and again, and reads nothing.
    at=${url#http://} token=${url#*#} at=${at%%/*}
    bash -c 'exec 3<>"/dev/tcp/${0%:*}/${0#*:}"; while printf "GET /snapshot?since=0 HTTP/1.1\r\nHost: %s\r\nAuthorization: Bearer %s\r\nfmlgs-protocol: 1.0\r\n\r\n" "$0" "$1" >&3; do sleep 0.3; done' "$at" "$token" 2>/dev/null &
    wait "$training"
    wait
    rate <"$folder/result"
}
median() { sort -n | awk '{ v[NR] = $1 } END { print (NR % 2) ? v[(NR + 1) / 2] : (v[NR / 2] + v[NR / 2 + 1]) / 2 }'; }
: >"$folder/alone"
: >"$folder/watched"
for round in $(seq "$rounds"); do
    train | rate >>"$folder/alone"
    watched >>"$folder/watched"
    echo "round $round: alone $(tail -1 "$folder/alone"), watched $(tail -1 "$folder/watched") steps/s"
done
alone=$(median <"$folder/alone") watched=$(median <"$folder/watched")
echo "medians of $rounds: alone $alone, watched $watched steps/s: $(echo "$alone $watched" | awk '{ printf "%+.1f %%", 100 * ($2 / $1 - 1) }')"
