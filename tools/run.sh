#!/usr/bin/env bash
# Builds and starts fmlgs. Without arguments: the window, or the headless demo where there is no
# display. With arguments: passes them on.
set -euo pipefail
cd "$(dirname "$0")/.."

tools/setup.sh run
. tools/rust.sh
. tools/environment.sh

profile=${PROFILE:-release}
cargo build --locked --profile "$profile" --bin fmlgs
folder=$profile
[ "$profile" = dev ] && folder=debug

if [ $# -eq 0 ] && [ -z "${DISPLAY:-}" ] && [ -z "${WAYLAND_DISPLAY:-}" ]; then
    echo "No display was found (neither DISPLAY nor WAYLAND_DISPLAY is set)."
    echo "Running the headless demo instead; its pictures and report go to out/demo/."
    set -- demo --headless --out out/demo
fi
# Not exec'ed, so that the run-time folder is removed at the end. Ctrl-C reaches the program itself.
"${CARGO_TARGET_DIR:-target}/$folder/fmlgs" "$@"
