#!/usr/bin/env bash
# What `fmlgs --version` of a package says: the version with the commit that it is built from and that commit's day.
# The same commit says the same, on every machine; FMLGS_COMMIT says it where there is no git, such as in an archive.
#
# usage: tools/version.sh [--number]     (--number: the version alone)
set -euo pipefail
cd "$(dirname "$0")/.."

number=$(sed -n 's/^version = "\(.*\)"/\1/p' Cargo.toml | head -n 1)
commit=${FMLGS_COMMIT:-}
if [ -z "$commit" ] && [ "${1:-}" != --number ] && git rev-parse --verify --quiet HEAD >/dev/null 2>&1; then
    commit=$(git show --no-patch --format='%h %cs' --abbrev=12 HEAD)
    git diff --quiet HEAD -- || commit="$commit, modified"
fi
if [ "${1:-}" = --number ] || [ -z "$commit" ]; then
    echo "$number"
else
    echo "$number ($commit)"
fi
