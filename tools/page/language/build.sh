#!/bin/sh
# Makes assets/page/language.wasm: the language of questions for the page. Needs a network once.
set -eu
cd "$(dirname "$0")"
rustup target add wasm32-unknown-unknown
root=$(cd ../../.. && pwd)
# Paths of this machine are no part of the file.
RUSTFLAGS="--remap-path-prefix=$root=. --remap-path-prefix=${CARGO_HOME:-$HOME/.cargo}=cargo \
--remap-path-prefix=$(rustc --print sysroot)=rust" \
CARGO_TARGET_DIR="${CARGO_TARGET_DIR:-$root/target/page}" cargo build --locked --release --target wasm32-unknown-unknown
cp "${CARGO_TARGET_DIR:-$root/target/page}/wasm32-unknown-unknown/release/fmlgs_page_language.wasm" \
    "$root/assets/page/language.wasm"
chmod 644 "$root/assets/page/language.wasm"
wc -c "$root/assets/page/language.wasm"
