#!/usr/bin/env bash
# Checks what packages are made of: desktop files, descriptions, scripts, and that the version is the same everywhere.
# What is not installed here is named and left out.
#
# usage: tools/check_packaging.sh
set -euo pipefail
cd "$(dirname "$0")/.."

has() { command -v "$1" >/dev/null || { echo "left out: $1 is not installed"; return 1; }; }
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

version=$(tools/version.sh --number)
for file in python/pyproject.toml python/src/fmlgs/__init__.py CITATION.cff; do
    grep -Eq "^(__)?version(__)? ?[=:] ?\"$version\"" "$file" || {
        echo "$file: its version is not $version, that of Cargo.toml" >&2
        exit 1
    }
done
if has desktop-file-validate; then desktop-file-validate packaging/linux/fmlgs.desktop; fi
if has xmllint; then
    xmllint --noout packaging/linux/*.xml packaging/macos/Info.plist packaging/windows/fmlgs.manifest assets/icon/fmlgs.svg
fi
if has appstreamcli; then
    described=$work/io.github.fmlgs.fmlgs.metainfo.xml
    sed 's/@DATE@/2026-01-01/' packaging/linux/io.github.fmlgs.fmlgs.metainfo.xml >"$described"
    appstreamcli validate --no-net "$described"
fi
if has shellcheck; then
    shellcheck --shell=bash --severity=error .ci/run tools/*.sh
    shellcheck --shell=bash --severity=warning --external-sources tools/{check_packaging,dist,package_deb,package_macos,package_windows,release,site,version,wheel}.sh
fi
if has mypy; then (cd python && mypy); fi
if has actionlint; then actionlint; fi
if has cffconvert; then cffconvert --validate; fi
if has cargo-deny; then cargo deny check licenses bans sources; fi
tools/advisories.sh || [ $? -eq 3 ]
echo "packaging: checked"
