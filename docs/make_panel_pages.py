"""Writes the pages in panel/ as HTML, which the ? of each panel opens: python docs/make_panel_pages.py"""

from __future__ import annotations

import re
from pathlib import Path

from markdown import markdown

PLACE = Path(__file__).resolve().parent / "panel"
HEAD = """<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<title>RefMesh: {title}</title>
<style>
body {{ max-width: 46em; margin: 2em auto; padding: 0 1em; font: 16px/1.5 sans-serif; color: #222; background: #fff; }}
table {{ border-collapse: collapse; }}
td, th {{ border: 1px solid #ccc; padding: 0.3em 0.6em; text-align: left; vertical-align: top; }}
code {{ background: #eee; padding: 0 0.2em; }}
img {{ max-width: 100%; }}
</style>
</head>
<body>
<p>{links}</p>
"""
ORDER = ("sequence", "track", "reference", "deform", "color", "export")  # of the steps


def main() -> None:
    """Writes all pages."""
    for page in sorted(PLACE.glob("*.md")):
        page.with_suffix(".html").write_text(html(page), encoding="utf-8")


def html(page: Path) -> str:
    """A page as HTML, with links to those of the other steps."""
    links = " | ".join(f"<b>{step.title()}</b>" if step == page.stem else f'<a href="{step}.html">{step.title()}</a>' for step in ORDER)
    body = markdown(page.read_text(encoding="utf-8"), extensions=["tables", "sane_lists"])
    body = re.sub(r'href="(\w+)\.md"', r'href="\1.html"', body)
    return f"{HEAD.format(title=page.stem.title(), links=links)}{body}\n</body>\n</html>\n"


if __name__ == "__main__":
    main()
