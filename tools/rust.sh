# Sourced by run.sh and test.sh: leaves a `cargo` in PATH that is new enough, or explains.
# usage: rust_components="clippy rustfmt"; . tools/rust.sh     (what else is needed; whoever sources this may have arguments
# of their own)

rust_needed=$(sed -n 's/^rust-version = "\(.*\)"/\1/p' Cargo.toml)

# Whether "$@" (a cargo) answers with version $rust_needed or newer.
rust_is_new_enough() {
    local version
    version=$("$@" --version 2>/dev/null | cut -d' ' -f2) || return 1
    [ -n "$version" ] && [ "$(printf '%s\n' "$rust_needed" "${version%%-*}" | sort -V | head -n 1)" = "$rust_needed" ]
}

if ! command -v cargo >/dev/null 2>&1 && ! command -v rustup >/dev/null 2>&1; then
    PATH="${CARGO_HOME:-$HOME/.cargo}/bin:$PATH"
    export PATH
fi

if ! rust_is_new_enough cargo; then
    if command -v rustup >/dev/null 2>&1; then
        if ! rust_is_new_enough rustup run stable cargo; then
            echo "setup: installing the stable Rust toolchain with rustup" >&2
            rustup toolchain install stable --profile minimal --component clippy --component rustfmt >&2 || true
        fi
        export RUSTUP_TOOLCHAIN=stable
    fi
    if ! rust_is_new_enough cargo; then
        {
            echo "setup: Rust $rust_needed or newer is needed; $(cargo --version 2>/dev/null || echo 'no cargo was found')."
            echo "setup: Install it from https://rustup.rs (or update it with 'rustup update stable'), then run this again."
        } >&2
        exit 1
    fi
fi

for component in ${rust_components:-}; do
    command=$component
    [ "$component" = rustfmt ] && command=fmt
    cargo "$command" --version >/dev/null 2>&1 && continue
    if ! command -v rustup >/dev/null 2>&1 || ! rustup component add "$component" >&2; then
        echo "setup: 'cargo $command' is missing. Install the Rust component '$component' ('rustup component add $component')." >&2
        exit 1
    fi
done
