#!/usr/bin/env python3
"""docs/library.md must show the examples as they are: those that the install test builds and runs.

    library_page_test.py SOURCE_FOLDER

A fenced block whose first line names a file ("// tests/install/example/register.cpp") must be that file, and every file
of the folder must have its block. No other block of the page may hold C++: nobody would compile it.
"""

import pathlib
import re
import sys

FENCED = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
NAMED = re.compile(r"^(?://|#) (tests/install/example/\S+)$")


def main():
    root = pathlib.Path(sys.argv[1])
    faults, shown = [], set()
    for language, block in FENCED.findall((root / "docs/library.md").read_text(encoding="utf-8")):
        named = NAMED.match(block.split("\n", 1)[0])
        if not named:
            if language == "cpp":
                faults.append("a block of C++ that names no file: " + block.split("\n", 1)[0])
            continue
        shown.add(named[1])
        path = root / named[1]
        if not path.is_file():
            faults.append(f"{named[1]} is not there")
        elif path.read_text(encoding="utf-8") != block:
            faults.append(f"{named[1]} differs from its block")
    for path in sorted((root / "tests/install/example").iterdir()):
        name = path.relative_to(root).as_posix()
        if name not in shown:
            faults.append(f"{name} has no block")
    if faults:
        sys.exit("docs/library.md and the examples disagree:\n" + "\n".join(faults))
    print(f"{len(shown)} blocks are as compiled")


if __name__ == "__main__":
    main()
