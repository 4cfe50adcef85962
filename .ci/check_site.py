"""Follow every link inside the built site, to files and to places in pages; pictures, frames, styles and scripts too."""

from __future__ import annotations

import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

SITE = Path(__file__).resolve().parents[1] / "out" / "site"
SOURCES = {"a": "href", "link": "href", "img": "src", "script": "src", "iframe": "src"}


class Page(HTMLParser):
    """Links of a page, and the places in it that can be linked."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.links: list[str] = []
        self.places: set[str] = set()
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Note a tag's place and its link."""
        named = dict(attrs)
        self.places |= {value for key in ("id", "name") if (value := named.get(key))}
        if link := named.get(SOURCES.get(tag, "")):
            self.links.append(link)


def broken_links(site: Path) -> list[str]:
    """Return a line for each link inside a site that leads nowhere.

    Args:
        site: Its folder.
    """
    reports = set(site.rglob("page.html"))  # a report stands by itself, and may weigh 2 MB
    pages = {path: Page(path.read_text(encoding="utf-8")) for path in sorted(site.rglob("*.html")) if path not in reports}
    faults: list[str] = []
    for path, page in pages.items():
        for link in page.links:
            parts = urlsplit(link)
            if parts.scheme or parts.netloc:
                continue
            target = (
                path
                if not parts.path
                else (site / parts.path[1:] if parts.path.startswith("/") else path.parent / unquote(parts.path))
            )
            target = (target / "index.html" if target.is_dir() else target).resolve()
            if not target.exists():
                faults.append(f"{path.relative_to(site)}: {link}: no such file")
            elif parts.fragment and target in pages and unquote(parts.fragment) not in pages[target].places:
                faults.append(f"{path.relative_to(site)}: {link}: no such place")
    return faults


if __name__ == "__main__":
    found = broken_links(SITE.resolve())
    print("\n".join(found) or "all links inside the site lead somewhere")
    sys.exit(bool(found))
