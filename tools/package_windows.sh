#!/usr/bin/env bash
# Builds fmlgs.exe with its icon, manifest and version, and packs it: out/fmlgs-VERSION-windows-x86_64.zip. Runs in
# Git's shell on Windows, with the resource compiler of Visual Studio (rc) or LLVM (llvm-rc) in PATH.
#
# usage: tools/package_windows.sh [--resource-only FOLDER]
set -euo pipefail
cd "$(dirname "$0")/.."

version=$(tools/version.sh --number)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
for file in fmlgs.rc fmlgs.manifest; do
    sed -e "s/@VERSION@/$version/g" -e "s/@COMMAS@/${version//./,}/g" "packaging/windows/$file" >"$work/$file"
done
cp assets/icon/fmlgs.ico "$work/"
if [ "${1:-}" = --resource-only ]; then
    mkdir -p "$2"
    cp "$work"/fmlgs.* "$2/"
    exit 0
fi

compiler=$(command -v llvm-rc || command -v rc) || {
    echo "package: neither 'rc' nor 'llvm-rc' was found in PATH" >&2
    exit 1
}
(cd "$work" && MSYS_NO_PATHCONV=1 "$compiler" /fo fmlgs.res fmlgs.rc)
resource=$(cygpath -m "$work/fmlgs.res")
program=$(RUSTFLAGS="-C link-arg=$resource -C target-feature=+crt-static" tools/dist.sh --target x86_64-pc-windows-msvc)
name=fmlgs-$version-windows-x86_64
mkdir -p "$work/$name" out
cp "$program" README.md LICENSE-MIT LICENSE-APACHE "$work/$name/"
python tools/third_party.py "$work/$name/THIRD_PARTY.md"
(cd "$work" && python -m zipfile -c "$name.zip" "$name")
mv "$work/$name.zip" out/
echo "out/$name.zip"
