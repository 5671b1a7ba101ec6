#!/usr/bin/env bash
# Stands in for rustdoc in `cargo test --doc`: makes the pages, of private items too, where it would test examples. So
# they are made of the libraries that tests are linked with.
set -euo pipefail
arguments=() pages=
for argument in "$@"; do
    case $argument in
        --test) pages=1 ;;
        --test-run-directory=* | --test-args=* | --no-run) ;;
        *) arguments+=("$argument") ;;
    esac
done
[ -z "$pages" ] || arguments+=(--document-private-items --output "${CARGO_TARGET_DIR:-target}/doc" -D warnings)
exec rustdoc "${arguments[@]}"
