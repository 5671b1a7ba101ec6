#!/usr/bin/env bash
# Makes the site that pages.yml publishes: the demo's scene as a page that any browser shows (index.html), and the
# documentation of the code (doc/).
#
# usage: tools/site.sh FOLDER [PROGRAM]     (PROGRAM: one that was built before)
set -euo pipefail
out=${1:?usage: tools/site.sh FOLDER [PROGRAM]}
cd "$(dirname "$0")/.."

program=${2:-$(PROFILE=release tools/dist.sh | tail -n 1)}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m zipfile -e assets/demo/demo.zip "$work"
mkdir -p "$out"
"$program" export "$work/scene" --html "$out/index.html" --quiet
if [ -z "${2:-}" ]; then
    cargo doc --locked --no-deps
    rm -rf "$out/doc"
    cp -r "${CARGO_TARGET_DIR:-target}/doc" "$out/doc"
fi
ls -l "$out"
