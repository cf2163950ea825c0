#!/usr/bin/env python3
"""Puts the row of a device that bench/gpu/run.sh measured into bench/records/devices.json, in the place of its old one.

    bench/gpu/add_row.py results/device.json [NAME of the device's row, default: what its driver says]

A row of a device that is still to be measured has a name and empty cells. Then: bench/make_tables.py.
"""

import json
import pathlib
import sys

RECORD = pathlib.Path(__file__).resolve().parent.parent / "records" / "devices.json"


def main(arguments):
    if len(arguments) not in (1, 2):
        sys.exit(__doc__)
    measured = json.loads(pathlib.Path(arguments[0]).read_text(encoding="utf-8"))
    record = json.loads(RECORD.read_text(encoding="utf-8"))
    names = [[column["name"] for column in table["columns"]] for table in (measured, record)]
    if names[0] != names[1]:
        sys.exit(f"{arguments[0]}: its columns are not those of {RECORD.name}: {', '.join(names[0])}")
    row = measured["rows"][0]
    row[0] = arguments[1] if len(arguments) == 2 else row[0]
    rows = [old for old in record["rows"] if old[0] != row[0]] + [row]
    rows.sort(key=lambda cells: (cells[1] == "", cells[0]))  # those without numbers last
    record["rows"] = rows
    record["machine"] += "" if measured["machine"] in record["machine"] else f"; {row[0]}: {measured['machine']}"
    RECORD.write_text(json.dumps(record, indent=2, ensure_ascii=False) + "\n", encoding="utf-8")
    print(f"{RECORD}: {row[0]}")


if __name__ == "__main__":
    main(sys.argv[1:])
