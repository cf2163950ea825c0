#!/usr/bin/env python3
"""Writes the tables of README.md and STUDIES.md from the records of what was measured.

    bench/make_tables.py            rewrites the pages
    bench/make_tables.py --check    prints what would change; exit code 1 if anything would

records/NAME.json belongs between the lines "<!-- table: NAME -->" and "<!-- end -->" of a page; no table stands
elsewhere. A record has the members
    machine, command   a record without these is refused
    title, compiler, notes, date   (of the commit that brought the numbers, where the day itself is not known)
    columns   [{"name": the heading, "unit": of its numbers, "format": how they are written, "{}" unless given}, ...]
    rows      [[cell, ...], ...]; a cell is a number, a list of numbers for a format with several {}, or a text
Numbers keep the digits that they were recorded with. The benchmark programs write such records by --json FILE.
"""

import difflib
import json
import pathlib
import re
import sys

FOLDER = pathlib.Path(__file__).resolve().parent
PAGES = [FOLDER / "README.md", FOLDER / "STUDIES.md"]
REGION = re.compile(r"^<!-- table: (\S+) -->\n(?:\|.*\n)*<!-- end -->\n", re.MULTILINE)


class Number(str):
    """A number as it was written; the format "{:,}" groups its digits."""

    def __format__(self, spec):
        return format(int(self), spec) if spec else str(self)


def read_record(path):
    record = json.loads(path.read_text(encoding="utf-8"), parse_int=Number, parse_float=Number)
    for key in ("machine", "command"):
        if not str(record.get(key, "")).strip():
            sys.exit(f"{path}: has no {key}: what cannot be repeated is not shown")
    if not record.get("columns") or not record.get("rows"):
        sys.exit(f"{path}: needs columns and rows")
    for number, row in enumerate(record["rows"], 1):
        if len(row) != len(record["columns"]):
            sys.exit(f"{path}: row {number} has {len(row)} cells for {len(record['columns'])} columns")
    return record


def cell_text(cell, column):
    if isinstance(cell, list):
        return column["format"].format(*cell)
    if isinstance(cell, Number):
        return column.get("format", "{}").format(cell)
    return cell.replace("|", "\\|")


def line(texts):
    return "|" + "|".join(f" {text} " if text else " " for text in texts) + "|\n"


def table(record):
    columns = record["columns"]
    rows = [line([cell_text(cell, column) for cell, column in zip(row, columns)]) for row in record["rows"]]
    return line([column["name"] for column in columns]) + "|" + "---|" * len(columns) + "\n" + "".join(rows)


def page_text(page, records):
    old = page.read_text(encoding="utf-8")

    def region(match):
        name = match.group(1)
        if name not in records:
            sys.exit(f"{page.name}: no records/{name}.json for the table {name}")
        return f"<!-- table: {name} -->\n{table(records[name])}<!-- end -->\n"

    rest = REGION.sub("", old)
    if stray := re.search(r"^(<!-- (table:.*|end) -->|\|[-|: ]+\|)$", rest, re.MULTILINE):
        sys.exit(f"{page.name}: a table or a marker without its other parts: {stray.group(0)}")
    return old, REGION.sub(region, old)


def main(arguments):
    if arguments not in ([], ["--check"]):
        sys.exit("usage: make_tables.py [--check]")
    records = {path.stem: read_record(path) for path in sorted((FOLDER / "records").glob("*.json"))}
    differs = False
    for page in PAGES:
        old, new = page_text(page, records)
        if old == new:
            continue
        differs = True
        if arguments:
            lines = difflib.unified_diff(old.splitlines(True), new.splitlines(True), page.name, "from records")
            print("".join(lines), end="")
        else:
            page.write_text(new, encoding="utf-8")
    return 1 if differs and arguments else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
