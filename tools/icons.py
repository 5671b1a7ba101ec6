#!/usr/bin/env python3
"""Draws assets/icon/fmlgs.svg in the sizes that desktops want, with rsvg-convert (Debian: librsvg2-bin): .png, .ico
for Windows, .icns for macOS. Run it after the drawing was changed; what it makes is committed.

usage: tools/icons.py
"""

import struct
import subprocess
from pathlib import Path

FOLDER = Path(__file__).resolve().parent.parent / "assets" / "icon"
# Sizes in px: of the .png files, of those within the .ico, of those within the .icns by their names there.
PNG = (16, 32, 48, 64, 128, 256)
ICO = PNG
ICNS = {"icp4": 16, "icp5": 32, "ic12": 64, "ic07": 128, "ic08": 256, "ic09": 512}


def draw(size: int) -> bytes:
    """The icon as the bytes of a .png."""
    command = ["rsvg-convert", "-w", str(size), "-h", str(size), FOLDER / "fmlgs.svg"]
    return subprocess.run(command, check=True, stdout=subprocess.PIPE).stdout


def ico(drawn: dict[int, bytes]) -> bytes:
    """All sizes in one file for Windows."""
    head = struct.pack("<HHH", 0, 1, len(ICO))
    at = len(head) + 16 * len(ICO)
    for size in ICO:
        head += struct.pack("<BBBBHHII", size % 256, size % 256, 0, 0, 1, 32, len(drawn[size]), at)
        at += len(drawn[size])
    return head + b"".join(drawn[size] for size in ICO)


def icns(drawn: dict[int, bytes]) -> bytes:
    """All sizes in one file for macOS."""
    parts = [name.encode() + struct.pack(">I", 8 + len(drawn[size])) + drawn[size] for name, size in ICNS.items()]
    body = b"".join(parts)
    return b"icns" + struct.pack(">I", 8 + len(body)) + body


def main() -> None:
    """Writes all of them."""
    drawn = {size: draw(size) for size in {*PNG, *ICO, *ICNS.values()}}
    for size in PNG:
        (FOLDER / f"fmlgs-{size}.png").write_bytes(drawn[size])
    (FOLDER / "fmlgs.ico").write_bytes(ico(drawn))
    (FOLDER / "fmlgs.icns").write_bytes(icns(drawn))


if __name__ == "__main__":
    main()
