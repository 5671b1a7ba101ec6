#!/bin/sh
# Renders every scene of a folder with `fmlgs synth`: render.sh FMLGS SCENES FROM TO [synth options]
fmlgs=$1; scenes=$2; from=$3; to=$4; shift 4
for i in $(seq "$from" "$to"); do
    n=$(printf '%04d' "$i")
    [ -e "$scenes/$n/identities.json" ] && continue
    "$fmlgs" synth "$scenes/$n.glb" --held-out 0 --points 0 --samples 2 --seed "$i" --quiet "$@" --out "$scenes/$n" >/dev/null || exit 1
    rm -rf "$scenes/$n/depth"
done
