#!/usr/bin/env bash
# Checks the dependencies against RustSec's advisories, by deny.toml. Needs cargo-deny, and the list: fetched if the network
# allows, else the copy that was fetched last, at most 90 days old. Ends with 0 if nothing was found, 3 if it could not
# check, which it says, and anything else if something was found.
set -uo pipefail
cd "$(dirname "$0")/.."

cannot() {
    echo "advisories: NOT CHECKED: $1"
    exit 3
}

command -v cargo-deny >/dev/null || cannot "cargo-deny is not installed (cargo install --locked cargo-deny)"
lists=${CARGO_HOME:-$HOME/.cargo}/advisory-dbs
if ! timeout 60 cargo deny fetch db index >/dev/null 2>&1; then
    [ -d "$lists" ] || cannot "RustSec's list is not here and cannot be fetched"
    [ -n "$(find "$lists" -maxdepth 3 -name FETCH_HEAD -mtime -90 2>/dev/null)" ] ||
        cannot "RustSec's list is over 90 days old and cannot be fetched"
    echo "advisories: RustSec's list cannot be fetched; checked against the copy in $lists"
fi
cargo deny --offline check advisories && echo "advisories: checked, nothing found"
