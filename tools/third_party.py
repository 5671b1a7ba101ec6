#!/usr/bin/env python3
"""Writes the licenses of everything that the program is made of, for packages: crates that it links with the texts
that their sources bring, and what of others lies in assets/.

usage: tools/third_party.py OUT [TARGET]     (OUT: a .md file; TARGET: such as x86_64-unknown-linux-gnu)
"""

import json
import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
NAMES = re.compile(r"^(un)?(licen[sc]e|copying|copyright|notice|ofl|ufl|authors)([-_.].*)?$", re.IGNORECASE)
# Of sources that a crate brings along; deeper folders are tests and examples.
DEPTH = 3
MAX_BYTES = 200_000
ASSETS = {
    "PlayCanvas engine (pages that are exported)": ROOT / "assets/page/renderer.LICENSE.txt",
    "WordNet (words that mean the same, and kinds of things)": ROOT / "assets/lexicon.LICENSE.txt",
}


def linked(target: str) -> list[dict]:
    """The crates that the program links on a target, by name."""
    command = ["cargo", "metadata", "--locked", "--format-version", "1", "--filter-platform", target]
    told = json.loads(subprocess.run(command, cwd=ROOT, check=True, stdout=subprocess.PIPE).stdout)
    packages = {p["id"]: p for p in told["packages"]}
    edges = {
        node["id"]: [d["pkg"] for d in node["deps"] if any(k["kind"] is None for k in d["dep_kinds"])]
        for node in told["resolve"]["nodes"]
    }
    root = told["resolve"]["root"]
    seen, left = {root}, [root]
    while left:
        new = [id for id in edges[left.pop()] if id not in seen]
        seen.update(new)
        left.extend(new)
    # Macros run in the compiler and are not part of the program.
    is_macro = lambda p: any("proc-macro" in t["kind"] for t in p["targets"])
    found = [packages[id] for id in seen - {root} if not is_macro(packages[id])]
    return sorted(found, key=lambda p: (p["name"], p["version"]))


def texts(folder: Path) -> list[str]:
    """The texts of licenses in a crate's source."""
    found = []
    for path in sorted(folder.rglob("*")):
        inside = path.relative_to(folder)
        if len(inside.parts) <= DEPTH and NAMES.match(path.name) and path.is_file() and path.stat().st_size <= MAX_BYTES:
            text = path.read_text(encoding="utf-8", errors="replace").strip()
            if text and path.suffix.lower() not in {".rs", ".c", ".h", ".html", ".toml", ".py"}:
                found.append(re.sub(r"[ \t\r]+\n", "\n", text + "\n").strip())
    return found


def host() -> str:
    """The target that cargo builds for."""
    told = subprocess.run(["rustc", "-vV"], check=True, stdout=subprocess.PIPE, text=True).stdout
    return next(line.split()[1] for line in told.splitlines() if line.startswith("host:"))


def main() -> None:
    """Writes the file."""
    if not 2 <= len(sys.argv) <= 3:
        sys.exit(__doc__)
    crates = linked(sys.argv[2] if len(sys.argv) == 3 else host())
    users: dict[str, list[str]] = {path.read_text().strip(): [name] for name, path in ASSETS.items()}
    lines = ["# What FMLGS is made of", "", "| crate | license | source |", "|---|---|---|"]
    for crate in crates:
        name = f"{crate['name']} {crate['version']}"
        license = crate["license"] or "see below"
        lines.append(f"| {name} | {license} | {crate['repository'] or '-'} |")
        for text in texts(Path(crate["manifest_path"]).parent):
            users.setdefault(text, []).append(name)
    for text, names in sorted(users.items(), key=lambda entry: entry[1][0].lower()):
        names = sorted(set(names), key=str.lower)
        lines += ["", f"## {', '.join(names)}", "", "```text", text.replace("```", "'''"), "```"]
    Path(sys.argv[1]).write_text("\n".join(lines) + "\n", encoding="utf-8")
    without = [c["name"] for c in crates if not texts(Path(c["manifest_path"]).parent)]
    print(f"{len(crates)} crates, {len(users)} texts; without a text of their own: {', '.join(without) or 'none'}")


if __name__ == "__main__":
    main()
