"""Fails if a page of the site has a link to a file, or a place in one, that is not there.

Those between pages of the Rust reference are `cargo doc`'s to check.
"""

import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit


class Page(HTMLParser):
    """The places in a page, and where it links to."""

    def __init__(self, path):
        super().__init__()
        self.ids, self.links = set(), []
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag, attributes):
        for name, value in attributes:
            if name == "id":
                self.ids.add(value)
            elif name in ("href", "src") and value:
                self.links.append(value)


def main(root):
    own = [path for path in root.rglob("*.html") if "rust" not in path.relative_to(root).parts]
    pages = {path: Page(path) for path in own}
    dead = []
    for path, page in pages.items():
        for link in page.links:
            address = urlsplit(link)
            if address.scheme or address.netloc:
                continue
            target = (path.parent / unquote(address.path)).resolve() if address.path else path
            place, known = unquote(address.fragment), pages.get(target)
            if not target.is_file() or place and known and place not in known.ids:
                dead.append(f"{path.relative_to(root)}: {link}")
    print("\n".join(dead) or f"{len(pages)} pages have no dead links")
    return bool(dead)


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]).resolve()))
