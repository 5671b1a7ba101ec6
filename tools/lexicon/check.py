#!/usr/bin/env python3
"""Compares the asset with the list of pairs that the program is tested with.

usage: tools/lexicon/check.py [NAME ASKED]     (or tells how a thing of this name is what was asked for)
"""

import sys
from pathlib import Path

from lookup import Lexicon

ROOT = Path(__file__).resolve().parent.parent.parent
PAIRS = ROOT / "src/scene/identity/lexicon/pairs.txt"


def main() -> None:
    lexicon = Lexicon(ROOT / "assets" / "lexicon.z")
    if len(sys.argv) == 3:
        print(lexicon.is_a(sys.argv[1], sys.argv[2]) or "no")
        return
    passed = failed = 0
    for line in PAIRS.read_text(encoding="utf-8").splitlines():
        if line.startswith("#"):
            continue
        name, asked, expected = line.split(" | ")
        found = lexicon.is_a(name, asked) or "no"
        if found == expected or (expected == "yes" and found != "no"):
            passed += 1
        else:
            failed += 1
            print(f"{name} is a {asked}: {found}, not {expected}")
    print(f"{passed} passed, {failed} failed")
    sys.exit(failed > 0)


if __name__ == "__main__":
    main()
