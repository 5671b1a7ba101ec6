# Sourced by run.sh and test.sh: gives graphics libraries the run-time folder that they insist on.

if [ -z "${XDG_RUNTIME_DIR:-}" ]; then
    XDG_RUNTIME_DIR=$(mktemp -d -t fmlgs-runtime-XXXXXX)
    chmod 700 "$XDG_RUNTIME_DIR"
    export XDG_RUNTIME_DIR
    runtime_dir_is_ours=$XDG_RUNTIME_DIR
    trap 'rm -rf "$runtime_dir_is_ours"' EXIT
fi
