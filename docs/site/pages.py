"""The Markdown of the manual: its headings, links, and the blocks that a reader would save and type."""

import pathlib
import re

ROOT = pathlib.Path(__file__).resolve().parents[2]

# Pages of the site beside docs/*.md, by their paths in the repository.
OTHER_PAGES = ["README.md", "CHANGELOG.md", "CONTRIBUTING.md", "third_party_notes.md", "core/CONVENTIONS.md", "core/io/geometry/README.md",
               "bench/README.md", "bench/STUDIES.md"]
# Made when the site is built: there are no such files in the repository.
GENERATED = ["docs/commands.md"]

FENCE = re.compile(r"^( *)(```+)(.*)$")
HEADING = re.compile(r"^(#{1,6}) +(.*?) *#*$")
LINK = re.compile(r"(!?)\[((?:[^\[\]]|\[[^\[\]]*\])*)\]\(([^()\s]+)\)")
FILE = re.compile(r"^<!-- file: (\S+) -->$")
PICTURE = re.compile(r"^<!-- picture: (\S+) \| (.*) -->$")
EXITS = re.compile(r"#\s*exits (\d+)\s*$")


def lines_outside_fences(text):
    """(index, line) of all lines that are not in a fenced block."""
    fence = None
    for index, line in enumerate(text.splitlines()):
        found = FENCE.match(line)
        if fence is None and found:
            fence = found[2]
        elif fence is not None:
            if line.strip() == fence:
                fence = None
        else:
            yield index, line


def anchor_of(title):
    """As GitHub makes it."""
    title = LINK.sub(lambda link: link[2], title)
    kept = re.sub(r"[^\w\- ]", "", title.strip().lower())
    return kept.replace(" ", "-")


def headings(text):
    """(index of the line, anchor) of each heading; a second one of the same name gets -1."""
    seen = {}
    for index, line in lines_outside_fences(text):
        found = HEADING.match(line)
        if not found:
            continue
        anchor = anchor_of(found[2])
        count = seen.get(anchor, 0)
        seen[anchor] = count + 1
        yield index, anchor if count == 0 else f"{anchor}-{count}"


def links(text):
    """(index of the line, link) of the relative links and pictures: not those in code, and none with a scheme."""
    for index, line in lines_outside_fences(text):
        for found in LINK.finditer(re.sub(r"`[^`]*`", lambda code: code[0] if "](" in line else "`" * len(code[0]), line)):
            before = line[:found.start()]
            if before.count("`") % 2 == 0 and not re.match(r"[a-z]+:", found[3]):
                yield index, found[3]


def fault_of_link(page, link, root=ROOT):
    """Why a link of the page (a path in the repository) leads nowhere; None where it leads somewhere."""
    path, _, anchor = link.partition("#")
    target = (root / page).parent / path if path else root / page
    name = target.resolve().relative_to(root.resolve()).as_posix() if target.resolve().is_relative_to(root.resolve()) else None
    if name in GENERATED:
        return None
    if name is None or not target.exists():
        return f"{page}: {link}: there is no such file in the repository"
    if anchor and target.suffix == ".md":
        if anchor not in {a for _, a in headings(target.read_text(encoding="utf-8"))}:
            return f"{page}: {link}: there is no such heading"
    return None


def steps(text):
    """What a reader does, in order: ("file", name, text), ("sh", code, 0), ("python", code, None), ("picture", name, caption)."""
    lines, index, file = text.splitlines(), 0, None
    while index < len(lines):
        fence = FENCE.match(lines[index])
        if found := FILE.match(lines[index]):
            file = found[1]
        elif found := PICTURE.match(lines[index]):
            yield "picture", found[1], found[2]
        elif fence:
            end = next(i for i in range(index + 1, len(lines)) if lines[i].strip() == fence[2])
            body = "\n".join(lines[index + 1:end]) + "\n"
            if file:
                yield "file", file, body
            elif fence[3] in ("sh", "python"):
                yield fence[3], body, exit_code(body) if fence[3] == "sh" else None
            file, index = None, end
        index += 1


def exit_code(code):
    """0, or what `# exits N` at the end of a block of one command says."""
    wanted = [int(found[1]) for line in code.splitlines() if (found := EXITS.search(line))]
    return wanted[-1] if wanted else 0


def in_short(text):
    """The first section of a page where it is called "In short", without its title."""
    found = re.search(r"^## In short\n\n(.*?)\n+(?=^## )", text, re.M | re.S)
    return found[1] if found else None
