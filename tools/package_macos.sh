#!/usr/bin/env bash
# Makes FMLGS.app of a program that was built for macOS and packs it: out/fmlgs-VERSION-macos-MACHINE.zip. It is not
# signed: a developer's certificate is needed for that (codesign, notarytool).
#
# usage: tools/package_macos.sh PROGRAM     (tools/dist.sh builds it)
set -euo pipefail
program=$(cd "$(dirname "${1:?usage: tools/package_macos.sh PROGRAM}")" && pwd)/$(basename "$1")
cd "$(dirname "$0")/.."

version=$(tools/version.sh --number)
name=fmlgs-$version-macos-${MACHINE:-$(uname -m)}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
contents=$work/$name/FMLGS.app/Contents
mkdir -p "$contents/MacOS" "$contents/Resources" out
cp "$program" "$contents/MacOS/fmlgs"
chmod 755 "$contents/MacOS/fmlgs"
cp assets/icon/fmlgs.icns "$contents/Resources/fmlgs.icns"
sed "s/@VERSION@/$version/" packaging/macos/Info.plist >"$contents/Info.plist"
cp README.md LICENSE-MIT LICENSE-APACHE "$work/$name/"
python3 tools/third_party.py "$work/$name/THIRD_PARTY.md"
# Without a signature of its own kind, a program for Apple's processors does not start.
! command -v codesign >/dev/null || codesign --force --sign - "$work/$name/FMLGS.app"
(cd "$work" && python3 -m zipfile -c "$name.zip" "$name")
mv "$work/$name.zip" out/
ls -l "out/$name.zip"
