#!/usr/bin/env python3
"""Links of the repository's pages lead somewhere, and the manual is whole. Needs no mkdocs.

    site_test.py SOURCE_FOLDER

Fails listing relative links and anchors of any .md file that lead nowhere, pages of docs/ and others that the site's menu does not name,
and first sections ("In short") that `raylign help` could not print: absent, too long, with links or long lines.
"""

import pathlib
import re
import subprocess
import sys

TOPICS = {"start": "start", "geometry": "geometry", "method": "method", "trust": "trust", "files": "formats", "limits": "limits", "bones": "bones", "place": "place"}
MOST_LINES, WIDTH = 25, 100


def markdown_files(root):
    """Those that git knows or would add: no build folders, no packages of others."""
    listed = subprocess.run(["git", "-C", root, "ls-files", "-co", "--exclude-standard", "*.md"], capture_output=True, text=True)
    names = listed.stdout.split("\n") if listed.returncode == 0 else [
        path.relative_to(root).as_posix() for path in root.rglob("*.md")
        if not re.match(r"build|demo_output|\.", path.relative_to(root).parts[0]) and "node_modules" not in path.parts]
    return sorted(name for name in names if name and (root / name).is_file())


def wrong_topics(root, pages):
    for topic, name in TOPICS.items():
        text = pages.in_short((root / f"docs/{name}.md").read_text(encoding="utf-8"))
        if text is None:
            yield f"docs/{name}.md does not begin with a section \"In short\""
            continue
        lines = text.splitlines()
        if len(lines) > MOST_LINES:
            yield f"docs/{name}.md: \"In short\" has {len(lines)} lines, at most {MOST_LINES} are a screen"
        for line in lines:
            if len(line) > WIDTH or not line.isascii() or pages.LINK.search(line) or "**" in line or line.startswith(("|", "#", "```")):
                yield f"docs/{name}.md: \"In short\" is printed by `raylign help {topic}` as it is, and has: {line}"


def wrong_menu(root, pages):
    menu = (root / "docs/site/mkdocs.yml").read_text(encoding="utf-8").split("\nnav:\n")[1]
    named = {name.replace("index.md", "README.md") for name in re.findall(r": (\S+\.md)$", menu, re.M)}
    there = set(pages.OTHER_PAGES) | set(pages.GENERATED) | {f"docs/{path.name}" for path in (root / "docs").glob("*.md")}
    yield from (f"docs/site/mkdocs.yml names {name}, which is no page" for name in sorted(named - there))
    yield from (f"docs/site/mkdocs.yml does not name {name}" for name in sorted(there - named))


def main():
    root = pathlib.Path(sys.argv[1]).resolve()
    sys.dont_write_bytecode = True
    sys.path.insert(0, str(root / "docs/site"))
    import pages

    faults, count = [], 0
    for name in markdown_files(root):
        for _, link in pages.links((root / name).read_text(encoding="utf-8")):
            count += 1
            fault = pages.fault_of_link(name, link, root)
            if fault:
                faults.append(fault)
    faults += [*wrong_topics(root, pages), *wrong_menu(root, pages)]
    if faults:
        sys.exit("The pages are not whole:\n" + "\n".join(faults))
    print(f"{count} links lead somewhere")


if __name__ == "__main__":
    main()
