#!/usr/bin/env bash
# Builds the program as packages carry it: optimized for size too, stripped, its version with the commit, and without
# a path of this machine in it. Its path is the last line of what this prints.
#
# usage: tools/dist.sh [CARGO OPTION...]     (such as --target aarch64-apple-darwin)
set -euo pipefail
cd "$(dirname "$0")/.."

case "$(uname -s)" in
Linux) tools/setup.sh run ;;
esac
. tools/rust.sh

profile=${PROFILE:-dist}
cargo_home=${CARGO_HOME:-$HOME/.cargo}
export FMLGS_VERSION
FMLGS_VERSION=${FMLGS_VERSION:-$(tools/version.sh)}
# Cargo strips a crate that a profile names (fmlgs, in that of releases) of debug information only, whatever is asked for.
export RUSTFLAGS="${RUSTFLAGS:-} -C strip=symbols --remap-path-prefix=$cargo_home/registry/src= --remap-path-prefix=$PWD=fmlgs"
# The last of what cargo makes is the program.
cargo build --locked --profile "$profile" --bin fmlgs --message-format json-render-diagnostics "$@" |
    sed -n 's/.*"executable":"\([^"]*\)".*/\1/p' | sed 's/\\\\/\\/g' | tail -n 1
