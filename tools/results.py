#!/usr/bin/env python3
"""Tables of docs/results: prints them as Markdown, or checks that each is well formed and linked from docs/measured.md.

usage: tools/results.py [NAME...]     prints these tables, or all
       tools/results.py --check       checks all; exit status 1 if one is broken

A table is a CSV file: a first line "# command; machine; ...", a header row of unique snake_case names, rows as long as
the header.
"""

import csv
import io
import pathlib
import re
import sys

DOCS = pathlib.Path(__file__).resolve().parent.parent / "docs"
FOLDER = DOCS / "results"
COLUMN = re.compile(r"[a-z0-9]+(_[a-z0-9]+)*")
LINK = re.compile(r"\(results/([\w-]+)\.csv\)")


def parse(text):
    """The table's origin (its first line), header and rows."""
    first, _, rest = text.partition("\n")
    rows = list(csv.reader(io.StringIO(rest), strict=True))
    return first[1:].strip(), rows[0] if rows else [], rows[1:]


def faults(text):
    """What is wrong with the text of a table, if anything."""
    if not re.match(r"# \S.{15,}", text):
        return ["the first line must be '# ' with the command and the machine"]
    try:
        _, header, rows = parse(text)
    except csv.Error as error:
        return [f"no CSV: {error}"]
    found = [f"column {name!r} is not snake_case" for name in header if not COLUMN.fullmatch(name)]
    if len(set(header)) != len(header):
        found.append("two columns have one name")
    if len(header) < 2 or not rows:
        found.append("a table has two columns and one row at least")
    for number, row in enumerate(rows, 3):
        if len(row) != len(header):
            found.append(f"row {number}: {len(row)} cells, {len(header)} columns")
        elif not row[0]:
            found.append(f"row {number}: the first cell is empty")
        elif any(cell != cell.strip() or "\n" in cell for cell in row):
            found.append(f"row {number}: space around a cell, or a line break in it")
    return found


def markdown(name, text):
    """A table as Markdown, under its name and origin."""
    origin, header, rows = parse(text)
    line = lambda cells: "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"
    table = [line(header), "|" + "---|" * len(header)] + [line(row) for row in rows]
    return f"## {name}\n\n{origin}\n\n" + "\n".join(table) + "\n"


def rules_hold():
    """Fails if a rule of `faults` lets a broken table pass, or refuses a good one."""
    origin = "# fmlgs bench SPLAT; two CPU cores\n"
    broken = ["a,b\n1,2\n", "# short\na,b\n1,2\n"]
    broken += [origin + body for body in ["", "a,b\n", "a,a\n1,2\n", "A b,c\n1,2\n", "a,b\n1\n", "a,b\n1,2,3\n"]]
    broken += [origin + body for body in ["a\n1\n", "a,b\n,2\n", "a,b\n1, 2\n", 'a,b\n1,"2\n', 'a,b\n1,"2\n3"\n']]
    for text in broken:
        assert faults(text), f"passes though it is broken: {text!r}"
    assert not faults(origin + 'a,b_2\n"1, or 2",\n'), faults(origin + 'a,b_2\n"1, or 2",\n')


def check():
    """Prints every fault; returns how many there are."""
    rules_hold()
    tables = sorted(FOLDER.glob("*.csv"))
    found = [f"{path.name}: {fault}" for path in tables for fault in faults(path.read_text(encoding="utf-8"))]
    here = {path.stem for path in tables}
    linked = set(LINK.findall((DOCS / "measured.md").read_text(encoding="utf-8")))
    found += [f"{name}.csv: docs/measured.md does not link to it" for name in sorted(here - linked)]
    found += [f"{name}.csv: docs/measured.md links to it, but it is missing" for name in sorted(linked - here)]
    print("\n".join(found + [f"{len(tables)} tables, {len(found)} faults"]))
    return len(found) + (not tables)


def main(arguments):
    if arguments == ["--check"]:
        return 1 if check() else 0
    names = arguments or sorted(path.stem for path in FOLDER.glob("*.csv"))
    for name in names:
        path = FOLDER / f"{name}.csv"
        if not path.is_file():
            print(f"results: {path} does not exist", file=sys.stderr)
            return 2
        print(markdown(name, path.read_text(encoding="utf-8")))
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
