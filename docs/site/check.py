#!/usr/bin/env python3
"""Every link, picture, style and script of a built site must be in it, with its anchor, and none comes from the network.

    check.py FOLDER
"""

import html.parser
import pathlib
import sys
import urllib.parse


class Page(html.parser.HTMLParser):
    def __init__(self, path):
        super().__init__()
        self.anchors, self.links, self.needed = {""}, [], []
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag, attributes):
        values = dict(attributes)
        self.anchors |= {values.get("id"), values.get("name")}
        if tag == "a" and values.get("href"):
            self.links.append(values["href"])
        self.needed += [values[key] for key in ("src", "href") if tag in ("img", "script", "link") and values.get(key)]


def faults_of(path, pages, root):
    page = pages[path]
    for link in page.links + page.needed:
        url = urllib.parse.urlparse(link)
        if url.scheme or url.netloc:
            if link in page.needed and url.scheme != "data":
                yield f"{path.relative_to(root)}: {link} comes from the network"
            continue
        target = (path.parent / urllib.parse.unquote(url.path)).resolve() if url.path else path
        target = target / "index.html" if target.is_dir() else target
        if not target.is_file():
            yield f"{path.relative_to(root)}: {link} is not there"
        elif target in pages and url.fragment and urllib.parse.unquote(url.fragment) not in pages[target].anchors:
            yield f"{path.relative_to(root)}: {link} has no such anchor"


def main():
    root = pathlib.Path(sys.argv[1]).resolve()
    pages = {path: Page(path) for path in sorted(root.rglob("*.html")) if path.name != "404.html"}
    faults = [fault for path in pages for fault in faults_of(path, pages, root)]
    if faults:
        sys.exit("The site is not whole:\n" + "\n".join(faults))
    print(f"{sum(len(page.links) for page in pages.values())} links of {len(pages)} pages lead somewhere")


if __name__ == "__main__":
    main()
