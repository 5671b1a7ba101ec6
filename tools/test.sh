#!/usr/bin/env bash
# Everything that must hold: formatting, lints, all tests, documentation. Ends with one line,
# "N passed, N failed, N skipped", and fails if anything failed. Reads nothing from a terminal.
set -uo pipefail
cd "$(dirname "$0")/.."
exec </dev/null

tools/setup.sh test || exit 1
rust_components="clippy rustfmt"
. tools/rust.sh
. tools/environment.sh

passed=0 failed=0 skipped=0
started=$SECONDS

# check NAME COMMAND...: runs it and counts it as one check.
check() {
    local name=$1 began=$SECONDS
    shift
    echo "== $name"
    if "$@"; then
        passed=$((passed + 1))
    else
        failed=$((failed + 1))
        echo "== $name FAILED"
    fi
    echo "== $name: $((SECONDS - began)) s"
}

# Sum of the numbers before word $1 in the harness's summary lines of $log.
summed() { sed -n "s/^test result: .*[.;] \([0-9]*\) $1;.*/\1/p" "$log" | awk '{ n += $1 } END { print n + 0 }'; }

run_tests() {
    # --show-output, so that tests which skip themselves can be seen and counted.
    cargo test --locked --no-fail-fast -- --show-output >"$log" 2>&1
    local status=$?
    grep -E '^(test .* (FAILED|ignored)|test result:|error|warning|skipped:)|panicked at' "$log"
    # Full output of failures, and of a build that did not get as far as tests.
    if [ $status -ne 0 ]; then
        sed -n '/^failures:$/,/^test result:/p' "$log"
        grep -q '^test result:' "$log" || tail -n 60 "$log"
    fi
    # A test that finds its input missing passes for the harness and prints "skipped: ..." itself.
    local itself ok bad
    itself=$(grep -c '^skipped: ' "$log")
    ok=$(summed passed) bad=$(summed failed)
    passed=$((passed + ok - itself))
    failed=$((failed + bad))
    skipped=$((skipped + itself + $(summed ignored)))
    # A crash or a build error fails the run without any test being counted.
    if [ $status -ne 0 ] && [ "$bad" -eq 0 ]; then
        failed=$((failed + 1))
    fi
}

mkdir -p target
log=target/test.log
check "formatting" cargo fmt --all --check
check "tables of docs/results" tools/results.py --check
# Clippy compiles what is tested, and pages are made of what was compiled: to check everything once more for each of
# them would take as long again.
export RUSTC_WORKSPACE_WRAPPER=clippy-driver CLIPPY_ARGS=-Dwarnings__CLIPPY_HACKERY__
check "lints and compilation" cargo test --locked --no-run --quiet
echo "== tests (full output in $log)"
run_tests
echo "== advisories"
tools/advisories.sh
case $? in
    0) passed=$((passed + 1)) ;;
    3) skipped=$((skipped + 1)) ;;
    *) failed=$((failed + 1)) ;;
esac
RUSTDOC=$PWD/tools/rustdoc_pages.sh check "documentation" cargo test --locked --doc --quiet

echo "== $((SECONDS - started)) s in all"
echo "$passed passed, $failed failed, $skipped skipped"
[ "$failed" -eq 0 ]
