"""Puts the program into the wheel, where `FMLGS_WHEEL_BINARY` names one: `pip install` then gives the command
`fmlgs` as well. The wheel's platform is read from the program. `FMLGS_WHEEL_LICENSES` names the licenses of what
the program is made of."""

from __future__ import annotations

import os
import re
import struct
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

_ELF_MACHINES = {62: "x86_64", 183: "aarch64"}
_MACH_O_MACHINES = {0x01000007: ("x86_64", "10_13"), 0x0100000C: ("arm64", "11_0")}


def platform_tag(program: bytes) -> str:
    """The platform that a program is for, as wheels call it."""
    if program[:6] == b"\x7fELF\x02\x01":
        machine = _ELF_MACHINES.get(struct.unpack_from("<H", program, 18)[0])
        # Names of the C library's versions that the program needs.
        versions = [tuple(map(int, v)) for v in re.findall(rb"\0GLIBC_(\d+)\.(\d+)(?=[\0.])", program)]
        if machine and versions:
            major, minor = max(versions)
            return f"manylinux_{major}_{minor}_{machine}"
    if program[:4] == b"\xcf\xfa\xed\xfe":
        found = _MACH_O_MACHINES.get(struct.unpack_from("<I", program, 4)[0])
        if found:
            return f"macosx_{found[1]}_{found[0]}"
    if program[:2] == b"MZ":
        header = struct.unpack_from("<I", program, 60)[0]
        if program[header : header + 6] == b"PE\0\0\x64\x86":
            return "win_amd64"
    raise SystemExit("FMLGS_WHEEL_BINARY is no program of a platform that is known here")


class ProgramHook(BuildHookInterface[Any]):
    """Adds the program among the wheel's scripts."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Called by the build."""
        if version == "editable":
            return
        for name in ("LICENSE-MIT", "LICENSE-APACHE"):
            build_data["force_include"][str(Path(self.root).parent / name)] = f"fmlgs/{name}"
        named = os.environ.get("FMLGS_WHEEL_BINARY")
        if not named:
            return
        licenses = os.environ.get("FMLGS_WHEEL_LICENSES")
        if licenses:
            build_data["force_include"][str(Path(licenses).absolute())] = "fmlgs/THIRD_PARTY.md"
        program = Path(named).absolute()
        tag = platform_tag(program.read_bytes())
        build_data["shared_scripts"][str(program)] = "fmlgs.exe" if tag.startswith("win") else "fmlgs"
        build_data["pure_python"] = False
        build_data["tag"] = f"py3-none-{tag}"
