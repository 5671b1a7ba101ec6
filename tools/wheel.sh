#!/usr/bin/env bash
# Makes wheels of the Python package in out/wheels/: one without the program, for every system, and with a
# PROGRAM another one that brings it, for its platform. The same source makes the same bytes.
#
# usage: tools/wheel.sh [PROGRAM]     (a stripped one: tools/dist.sh)
set -euo pipefail
program=${1:+$(realpath "$1")}
cd "$(dirname "$0")/.."

python=${PYTHON:-python3}
"$python" -m pip --version >/dev/null 2>&1 || {
    echo "wheel: '$python' has no pip; install it (Debian: python3-pip) or name another Python by PYTHON" >&2
    exit 1
}
out=out/wheels
mkdir -p "$out"
rm -f "$out"/fmlgs-*.whl
make_wheel() { "$python" -m pip wheel --quiet --disable-pip-version-check --no-deps --wheel-dir "$out" ./python; }

make_wheel
if [ -n "$program" ]; then
    FMLGS_WHEEL_BINARY=$program make_wheel
fi
ls -l "$out"/*.whl
