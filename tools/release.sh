#!/usr/bin/env bash
# Builds the program and packs it for this system: everything that a release carries comes to lie in out/release/.
#
# usage: tools/release.sh [PROGRAM]     (PROGRAM: packs this one, which was built before; not on Windows)
set -euo pipefail
cd "$(dirname "$0")/.."

rm -rf out/release out/wheels
mkdir -p out/release
case "$(uname -s)" in
Linux)
    program=${1:-$(tools/dist.sh | tail -n 1)}
    tools/package_deb.sh "$program"
    mv out/fmlgs_*.deb out/release/
    ;;
Darwin)
    program=${1:-$(tools/dist.sh | tail -n 1)}
    tools/package_macos.sh "$program"
    mv out/fmlgs-*-macos-*.zip out/release/
    ;;
*)
    program=$(tools/package_windows.sh | tail -n 1)
    mv out/fmlgs-*-windows-*.zip out/release/
    ;;
esac
tools/wheel.sh "$program"
mv out/wheels/*.whl out/release/
(cd out/release && for file in *; do sha256sum "$file" >"$file.sha256"; done)
ls -l out/release
