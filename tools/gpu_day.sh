#!/usr/bin/env bash
# Everything that is worth measuring where there is a GPU, into one folder: the tests of all kernels, images per second,
# training steps per second, PSNR against seconds, gsplat beside it. About eight minutes with a GPU, once it is built.
#
# usage: tools/gpu_day.sh OUT [--small] [--photos FOLDER] [--cargo-tests] [SPLAT...]
#   --small        small images and few steps, on whatever adapter there is: shows that this script works
#   --photos       posed photos to train on, undistorted and with a transforms.json for gsplat
#   --cargo-tests  the tests of kernels too, which are built first; without a real GPU they fail
#   SPLAT          what is drawn
# FMLGS names the program; without it, it is built. OUT/gpu_day.json and OUT/gpu_day.md are the result; every step has a
# log of its own there, and one that fails is told and does not end the others.
set -uo pipefail
cd "$(dirname "$0")/.."

small='' photos='' tests='' splats=()
out=${1:?usage: tools/gpu_day.sh OUT [--small] [--photos FOLDER] [--cargo-tests] [SPLAT...]}
shift
while [ $# -gt 0 ]; do
    case $1 in
        --small) small=yes ;;
        --photos) photos=${2:?--photos needs a folder}; shift ;;
        --cargo-tests) tests=yes ;;
        -*) echo "gpu_day: unknown option $1" >&2; exit 2 ;;
        *) splats+=("$1") ;;
    esac
    shift
done
if [ -e "$out" ] && [ -n "$(ls -A "$out" 2>/dev/null)" ]; then
    echo "gpu_day: $out is not empty; name another folder" >&2
    exit 2
fi
mkdir -p "$out"

if [ -z "${FMLGS:-}" ]; then
    cargo build --locked --release --bin fmlgs || exit 1
    FMLGS=${CARGO_TARGET_DIR:-target}/release/fmlgs
fi
sizes=(--size 1280x720 --size 1920x1080) repeats=20 side=504 most=45000 marks='1000 3000 7000'
if [ -n "$small" ]; then
    sizes=(--size 160x90) repeats=1 side=96 most=1000 marks=10
fi

# step NAME COMMAND...: runs it, its output in OUT/NAME.json (standard output) and OUT/NAME.log.
step() {
    local name=$1 began=$SECONDS
    shift
    echo "== $name"
    if timeout "${LIMIT:-240}" "$@" >"$out/$name.json" 2>"$out/$name.log"; then
        echo "== $name: $((SECONDS - began)) s"
    else
        echo "== $name FAILED ($?), see $out/$name.log"
        echo "$name" >>"$out/failed"
    fi
}

if [ -n "$tests" ]; then
    REQUIRE_GPU=1 LIMIT=600 step kernels cargo test --locked --release --test gpu
fi
if [ ${#splats[@]} -gt 0 ]; then
    step images "$FMLGS" bench "${splats[@]}" "${sizes[@]}" --repeats "$repeats" --gpu --json
    step gsplat_images python3 tools/gpu_day/gsplat_times.py "${sizes[@]}" --repeats "$repeats" "${splats[@]}"
fi
if [ -n "$photos" ]; then
    step steps "$FMLGS" bench "$photos" --max-side "$side" --repeats "$repeats" --gpu --json
    for steps in $marks; do
        step "train_$steps" "$FMLGS" train "$photos" --out "$out/scene_$steps" --steps "$steps" --max-side "$side" \
            --max-gaussians "$most" --backend gpu --eval-every 0 --json
        for strategy in mcmc default; do
            step "gsplat_${strategy}_train_$steps" python3 tools/gpu_day/gsplat_train.py "$photos" \
                --strategy "$strategy" --steps "$steps" --gaussians "$most" --max-side "$side"
        done
    done
fi
python3 tools/gpu_day/table.py "$out"
[ ! -e "$out/failed" ]
