#!/usr/bin/env python3
"""Puts the pages of the manual together for mkdocs.

    assemble.py FOLDER [RAYLIGN]

Copies every page to its own path below FOLDER, with anchors as GitHub has them. Links to what is no page become the path in code. With the
program it writes docs/commands.md from --help, and runs the pages that show pictures. Fails where a link leads nowhere.
"""

import os
import pathlib
import re
import shutil
import subprocess
import sys

import pages


def run(program, *arguments):
    return subprocess.run([program, *arguments], capture_output=True, text=True, check=True).stdout


def commands_page(program):
    """One section a command, from its own help."""
    text = ["# Commands", "", f"What `--help` prints, of {run(program, '--version').strip()}. `raylign COMMAND --help` prints it anywhere.", ""]
    overview = run(program, "--help")
    names = re.findall(r"^  ([a-z]+)  ", overview.split("\nCommands:\n")[1].split("\n\n")[0], re.M)
    text += ["- " + ", ".join(f"[{name}](#raylign-{name})" for name in names), ""]
    for title, arguments in [("raylign", []), *((f"raylign {name}", [name]) for name in names)]:
        text += [f"## `{title}`", "", "```text", run(program, *arguments, "--help").rstrip(), "```", ""]
    return "\n".join(text)


def take_pictures(page, text, program, folder):
    """Runs the page up to its last picture, as a reader would; the pictures are left beside the page."""
    wanted = [name for kind, name, _ in pages.steps(text) if kind == "picture"]
    if not wanted:
        return
    work = folder / "work" / page
    shutil.rmtree(work, ignore_errors=True)
    work.mkdir(parents=True)
    path = f"{pathlib.Path(program).parent}:{os.environ['PATH']}"
    for kind, what, more in pages.steps(text):
        if kind == "file":
            (work / what).write_text(more)
        elif kind == "sh" and not all((work / name).exists() for name in wanted):
            done = subprocess.run(["bash", "-ec", what], cwd=work, env={**os.environ, "PATH": path}, capture_output=True, text=True)
            if done.returncode != more:
                sys.exit(f"{page}: ended with {done.returncode} instead of {more}:\n{what}{done.stderr}")
    for name in wanted:
        picture = folder / picture_path(page, name)
        picture.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(work / name, picture)
    shutil.rmtree(folder / "work")


def picture_path(page, name):
    return f"pictures/{pathlib.Path(page).stem}/{name}"


def shown_picture(page, found, program):
    if not program:
        return f"*(A picture belongs here. This site was built without the program: {found[2]})*"
    up = "../" * page.count("/")
    return f"![{found[2]}]({up}{picture_path(page, found[1])})\n\n*{found[2]}*"


def rewritten_link(page, link, is_page, copied):
    """Where the link leads on the site; None where that is no part of it."""
    path, hash_sign, anchor = link.partition("#")
    if not path:
        return link
    target = ((pages.ROOT / page).parent / path).resolve()
    name = target.relative_to(pages.ROOT).as_posix()
    if target.is_dir() and (target / "README.md").is_file():
        name += "/README.md"
    if name in is_page:
        return os.path.relpath(site_path(name), pathlib.Path(site_path(page)).parent) + hash_sign + anchor
    if target.suffix in (".png", ".svg", ".jpg"):
        copied.add(name)
        return os.path.relpath(name, pathlib.Path(site_path(page)).parent)
    return None


def site_path(page):
    return "index.md" if page == "README.md" else page


def assembled(page, text, is_page, program, copied):
    anchors = dict(pages.headings(text))
    outside = dict(pages.lines_outside_fences(text))
    lines = text.splitlines()

    def link(found):
        target = found[3]
        if re.match(r"[a-z]+:", target):
            return found[0]
        new = rewritten_link(page, target, is_page, copied)
        if new is not None:
            return f"{found[1]}[{found[2]}]({new})"
        name = ((pages.ROOT / page).parent / target.partition("#")[0]).resolve().relative_to(pages.ROOT).as_posix()
        return f"{found[2]} (`{name}`)" if found[2].strip("`") != name else f"`{name}`"

    for index, line in outside.items():
        if found := pages.PICTURE.match(line):
            lines[index] = shown_picture(page, found, program)
            continue
        parts = re.split(r"(`[^`]*`(?!\]))", line) if "](" in line else [line]
        lines[index] = "".join(part if part.startswith("`") else pages.LINK.sub(link, part) for part in parts)
        if index in anchors:
            lines[index] += f" {{: #{anchors[index]} }}"
    return with_loose_lists("\n".join(lines) + "\n")


def with_loose_lists(text):
    """GitHub begins a list right below a paragraph, mkdocs only after an empty line."""
    lines, result = text.splitlines(), []
    outside = {index for index, _ in pages.lines_outside_fences(text)}
    for index, line in enumerate(lines):
        begins = index in outside and re.match(r"([-*]|\d+\.) ", line)
        if begins and result and result[-1].strip() and not re.match(r"([-*]|\d+\.) |  ", result[-1]):
            result.append("")
        result.append(line)
    return "\n".join(result) + "\n"


def main():
    folder = pathlib.Path(sys.argv[1]).resolve()
    program = os.path.abspath(sys.argv[2]) if len(sys.argv) > 2 else None
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    texts = {name: (pages.ROOT / name).read_text(encoding="utf-8") for name in pages.OTHER_PAGES}
    texts |= {f"docs/{path.name}": path.read_text(encoding="utf-8") for path in sorted((pages.ROOT / "docs").glob("*.md"))}
    faults = [fault for name, text in texts.items() for _, link in pages.links(text) if (fault := pages.fault_of_link(name, link))]
    if faults:
        sys.exit("Links that lead nowhere:\n" + "\n".join(faults))
    texts["docs/commands.md"] = commands_page(program) if program else (
        "# Commands\n\nThis site was built without the program, from whose `--help` this page is made. `raylign COMMAND --help` prints it.\n")
    copied = set()
    for name, text in texts.items():
        page = folder / site_path(name)
        page.parent.mkdir(parents=True, exist_ok=True)
        page.write_text(assembled(name, text, texts, program, copied), encoding="utf-8")
        if program:
            take_pictures(name, text, program, folder)
    for name in copied:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(pages.ROOT / name, folder / name)
    print(f"{len(texts)} pages")


if __name__ == "__main__":
    main()
