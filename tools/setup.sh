#!/usr/bin/env bash
# Installs the system packages that are missing; does nothing, and needs no rights, where all
# are there.
#
# usage: tools/setup.sh run|test     (test adds what only the tests need, into target/ where it can)
set -euo pipefail

mode=${1:?usage: tools/setup.sh run|test}
missing=()

say() { printf 'setup: %s\n' "$*" >&2; }

# What the dynamic loader finds (Debian keeps ldconfig out of users' PATH).
libraries=$(PATH="$PATH:/sbin:/usr/sbin" ldconfig -p 2>/dev/null || true)
has_library() { [[ "$libraries" == *"$1"* ]]; }
has_command() { command -v "$1" >/dev/null 2>&1; }
has_chinese_font() { [ -e /usr/share/fonts/truetype/droid/DroidSansFallbackFull.ttf ] || [ -n "$(fc-list :lang=zh file 2>/dev/null)" ]; }
has_numpy() { python3 -c 'import numpy' 2>/dev/null || /usr/bin/python3 -c 'import numpy' 2>/dev/null; }
has_vulkan_driver() { compgen -G '/usr/share/vulkan/icd.d/*.json' >/dev/null || compgen -G '/etc/vulkan/icd.d/*.json' >/dev/null; }

# need PACKAGE CHECK ARGUMENT...: remembers PACKAGE if the check fails.
need() {
    local package=$1
    shift
    "$@" || missing+=("$package")
}

# A linker and the C library's start-up files, for Rust; a C++ compiler, for the video encoder.
need gcc has_command cc
need g++ has_command c++
need libc6-dev test -n "$(compgen -G '/usr/lib/*/crt1.o' || compgen -G '/usr/lib*/crt1.o')"
# Certificates, for crates.io.
need ca-certificates test -e /etc/ssl/certs/ca-certificates.crt -o -e /etc/pki/tls/certs/ca-bundle.crt
# Vulkan: the loader, and Mesa's drivers (among them llvmpipe, which needs no GPU).
need libvulkan1 has_library libvulkan.so.1
need mesa-vulkan-drivers has_vulkan_driver
# OpenGL, which draws the window where Vulkan is emulated.
need libgl1 has_library libGL.so.1
need libegl1 has_library libEGL.so.1
need libgl1-mesa-dri test -n "$(compgen -G '/usr/lib/*/dri/swrast_dri.so' || compgen -G '/usr/lib*/dri/swrast_dri.so')"
# The window: X11 and Wayland clients are loaded at run time.
need libx11-6 has_library libX11.so.6
need libx11-xcb1 has_library libX11-xcb.so.1
need libxcb1 has_library libxcb.so.1
need libxcursor1 has_library libXcursor.so.1
need libxi6 has_library libXi.so.6
need libxkbcommon0 has_library libxkbcommon.so.0
need libxkbcommon-x11-0 has_library libxkbcommon-x11.so.0
need libwayland-client0 has_library libwayland-client.so.0
if [ "$mode" = test ]; then
    # A font with Chinese letters, for the test that types some.
    need fonts-droid-fallback has_chinese_font
    # A virtual display for the test that opens a real window.
    need xvfb has_command Xvfb
    # For the tests of the Python package.
    need python3-numpy has_numpy
    # A browser, and what drives it, for the test of exported pages.
    need chromium has_command chromium
    need chromium-driver has_command chromedriver
fi

# The library of ONNX Runtime, which the built-in engine is held against: out of its wheel, where there is
# pip. Without it one test is skipped, and counted.
fetch_onnxruntime() {
    local folder wheel
    folder=$(dirname "$0")/../target/onnxruntime
    [ -z "$(compgen -G "$folder/onnxruntime/capi/libonnxruntime.*")" ] || return 0
    has_command python3 && python3 -m pip --version >/dev/null 2>&1 || return 0
    say "fetching the wheel of ONNX Runtime into target/"
    mkdir -p "$folder"
    if python3 -m pip download --quiet --disable-pip-version-check --no-deps --only-binary=:all: \
        --dest "$folder" 'onnxruntime>=1.24' 2>/dev/null &&
        wheel=$(compgen -G "$folder/onnxruntime-*.whl" | head -n 1) &&
        python3 -m zipfile -e "$wheel" "$folder"; then
        rm -f "$wheel"
    else
        say "it cannot be had here; the test that needs it is skipped"
    fi
}
if [ "$mode" = test ]; then
    fetch_onnxruntime
fi

# Other systems bring all of it themselves, the compiler with Xcode or Visual Studio.
[ "$(uname -s)" = Linux ] || exit 0
[ ${#missing[@]} -gt 0 ] || exit 0

if ! has_command apt-get; then
    say "these are missing, under Debian's names: ${missing[*]}"
    say "install your system's packages of the same purpose, then run this again"
    exit 1
fi

install=(apt-get install -y --no-install-recommends "${missing[@]}")
as_root=()
if [ "$(id -u)" -ne 0 ]; then
    # Ask for a password only where somebody can type it.
    if has_command sudo && { sudo -n true 2>/dev/null || [ -t 0 ]; }; then
        as_root=(sudo)
    else
        say "some packages are missing and only root may install them. As root, run:"
        say "    apt-get update && ${install[*]}"
        exit 1
    fi
fi

say "installing ${missing[*]}"
export DEBIAN_FRONTEND=noninteractive
log=$(mktemp)
trap 'rm -f "$log"' EXIT
if ! { "${as_root[@]}" apt-get update && "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive "${install[@]}"; } >"$log" 2>&1; then
    tail -n 20 "$log" >&2
    say "apt-get failed (above). Check the network and /etc/apt/sources.list*, then run:"
    say "    apt-get update && ${install[*]}"
    exit 1
fi
