#!/usr/bin/env python3
"""Every source that the code cites must have an entry in docs/bibliography.md, and the entry must be true.

    bibliography_test.py SOURCE_FOLDER

Citations are [Name99], or [Name 1999] with any number of names and years between the brackets. Fails listing those
without an entry, the files that an entry names and that are not there or do not mention the author, and entries that
name no file.
"""

import pathlib
import re
import sys

FOLDERS = ["core", "backends", "apps", "bench", "tests"]
SOURCES = {".h", ".cpp", ".md", ".glsl", ".comp", ".frag", ".vert", ".js", ".cmake", ".json"}
NOT_OURS = {"package-lock.json"}

KEY = re.compile(r"\[([A-Z][A-Za-zÀ-ž]*[a-zà-ž])(\d\d)\]")
YEARS = re.compile(r"\[((?:van |von |de |der )*[A-Z][^\[\]]*\b(?:1[89]|20)\d\d(?:, [^\[\]]*)?)\]")
ENTRY = re.compile(r"^\*\*\[([A-Z]\w*?[a-z])(\d\d)\]\*\*", re.MULTILINE)
FIRST_NAME_AND_YEAR = re.compile(r"^(?:[a-z]+ )*([A-ZÀ-Ž][\w'-]+).*?\b((?:1[89]|20)\d\d)\b")


def unwrapped(text):
    """Comments that go on in the next line, as one."""
    return re.sub(r"\n[ \t]*(?:///?<?|#|\*)?[ \t]*", " ", text)


def sources(root):
    for folder in FOLDERS:
        for path in sorted((root / folder).rglob("*")):
            if path.suffix in SOURCES and path.name not in NOT_OURS and "node_modules" not in path.parts:
                yield path


def citations(text):
    """Keys, each with the text that cites it."""
    text = unwrapped(text)
    for name, year in KEY.findall(text):
        yield name + year, f"[{name}{year}]"
    for inside in YEARS.findall(text):
        for part in inside.split(";"):
            found = FIRST_NAME_AND_YEAR.match(part.strip())
            yield (found[1] + found[2][2:] if found else None), f"[{inside}]"


def entries(page):
    """Key: (the first author's name, the paragraph)."""
    places = [(match.start(), match[1], match[1] + match[2]) for match in ENTRY.finditer(page)]
    for i, (begin, name, key) in enumerate(places):
        end = places[i + 1][0] if i + 1 < len(places) else len(page)
        yield key, (name, page[begin:end].split("\n## ")[0])


def wrong_files(root, listed):
    for key, (name, paragraph) in listed.items():
        for file in re.findall(r"`((?:core|backends|apps|bench|tests)/[^`]+)`", paragraph):
            path = root / file
            if not path.is_file():
                yield f"[{key}] names {file}, which is not there"
            elif name.lower() not in path.read_text(encoding="utf-8").lower():
                yield f"[{key}] names {file}, which does not mention {name}"


def main():
    root = pathlib.Path(sys.argv[1])
    listed = dict(entries((root / "docs/bibliography.md").read_text(encoding="utf-8")))
    faults, count = [], 0
    for path in sources(root):
        for key, text in citations(path.read_text(encoding="utf-8")):
            count += 1
            if key not in listed:
                faults.append(f"{path.relative_to(root)} cites {text}, which has no entry")
    faults += wrong_files(root, listed)
    faults += [f"[{key}] names no file that uses it" for key, (_, text) in listed.items() if "`" not in text]
    if faults:
        sys.exit("docs/bibliography.md and the code disagree:\n" + "\n".join(sorted(set(faults))))
    print(f"{count} citations lead to {len(listed)} entries")


if __name__ == "__main__":
    main()
