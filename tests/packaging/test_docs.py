"""What README and docs name is there."""

import re
import runpy
from dataclasses import fields
from pathlib import Path

import pytest

from refmesh_addon.core.presets import PRESETS
from refmesh_addon.core.settings import flat_fields
from refmesh_addon.io.report import ENTRIES, DriftReport, Report, TransientReport

ROOT = Path(__file__).resolve().parents[2]
PANEL_PAGES = sorted(ROOT.glob("docs/panel/*.md"))
PAGES = [ROOT / "README.md", ROOT / "CHANGELOG.md", *sorted(ROOT.glob("docs/*.md")), *PANEL_PAGES, *sorted(ROOT.glob("*/README.md"))]
LARGEST = 2_000_000  # bytes of all pictures together: they are fetched with every clone
every_page = pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))


@every_page
def test_links_lead_to_files_and_headings(page):
    for target in re.findall(r"\]\(([^)\s]+)\)", page.read_text()):
        if target.startswith("https://"):
            continue
        path, _, heading = target.partition("#")
        found = (page.parent / path).resolve() if path else page
        assert found.exists(), target
        headings = [re.sub(r"[^a-z0-9_ -]", "", line.lstrip("# ").lower()).replace(" ", "-") for line in lines_of(found) if line[:1] == "#"]
        assert not heading or heading in headings, target


@every_page
def test_targets_of_make_are_there(page):
    targets = re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(), flags=re.MULTILINE)
    named = re.findall(r"^    make ([a-z-]+(?: [a-z-]+)*)|`make ([a-z-]+)`", page.read_text(), flags=re.MULTILINE)
    assert {word for names in named for word in " ".join(names).split()} <= set(targets)


@every_page
def test_modules_that_are_run_are_there(page):
    for module in re.findall(r"-m ((?:benchmarks|sample_scenes)[\w.]*)", page.read_text()):
        assert (ROOT / module.replace(".", "/")).with_suffix(".py").is_file(), module


def test_options_of_the_command_line_are_there():
    """An option is a setting, a property of an operator, an option of an exported format, or one that the script itself adds."""
    sources = "".join(path.read_text() for path in [*ROOT.glob("headless/*.py"), *ROOT.glob("refmesh_addon/operators/*.py")])
    settings = {item.name for item in flat_fields()}
    for path in (ROOT / "refmesh_addon" / "bridge" / "formats").glob("*.py"):
        settings |= {f"export_{name}_{option}" for name in known_names(path) for option in declared_options(path)}
    page = (ROOT / "docs" / "headless.md").read_text()
    for option in re.findall(r"^\| .*?`--([a-z-]+)", page, flags=re.MULTILINE):
        name = option.removeprefix("no-").replace("-", "_")
        assert name in settings or re.search(rf"^ +\"?{name}\"?: |\"--{option}\"", sources, flags=re.MULTILINE), option
    assert "|".join(PRESETS) in page.replace("\\", "")


def test_every_key_of_the_report_is_explained():
    page = (ROOT / "docs" / "headless.md").read_text()
    explained = set(re.findall(r"`([a-z0-9_]+)`", page[page.index("In `report.json`") :]))
    for kind in (Report, TransientReport, DriftReport, *ENTRIES.values()):
        assert {field.name for field in fields(kind)} <= explained, kind.__name__


@pytest.mark.parametrize("page", [ROOT / "docs" / "artist.md", *PANEL_PAGES], ids=lambda page: page.name)
def test_words_of_the_panel_are_those_that_artists_read(page):
    page = " ".join(page.read_text().split())
    sources = "".join(path.read_text() for path in (ROOT / "refmesh_addon").rglob("*.py"))
    settings = {item.metadata["label"] or item.name.replace("_", " ").title() for item in flat_fields()}
    formats = (ROOT / "refmesh_addon" / "bridge" / "formats").glob("*.py")
    settings |= {name.replace("_", " ").title() for path in formats for name in declared_options(path)}
    blenders = {"Edit", "Preferences", "Get Extensions", "Install from Disk", "File", "Import", "Add-ons"}
    blenders |= {"RefMesh", "Mesh Sequence (RefMesh)"}
    for label in re.findall(r"(?<!\*)\*([A-Z][^*]+)\*(?!\*)", page):
        for word in label.split(" > "):
            assert word in settings | blenders or f'"{word}"' in sources or f'"{word.lower()}": "' in sources, word


def test_the_map_of_rooms_has_every_room():
    """`make pictures` draws it anew."""
    folders = [folder for package in ("core", "pipeline", "bridge") for folder in (ROOT / "refmesh_addon" / package).iterdir()]
    rooms = {folder.name for folder in folders if (folder / "__init__.py").exists()}
    drawn = set(re.findall(r">([a-z]+)</text>", (ROOT / "docs" / "pictures" / "rooms.svg").read_text()))
    assert rooms <= drawn


@pytest.mark.parametrize("page", PANEL_PAGES, ids=lambda page: page.name)
def test_pages_that_the_panel_opens_are_those_of_the_text(page):
    """`make pages` writes them."""
    pytest.importorskip("markdown", reason="make environment installs it")
    html = runpy.run_path(str(ROOT / "docs" / "make_panel_pages.py"))["html"]
    assert page.with_suffix(".html").read_text(encoding="utf-8") == html(page)


@pytest.mark.parametrize("page", PANEL_PAGES, ids=lambda page: page.name)
def test_pictures_of_the_panel_are_shown_by_every_program(page):
    """Some show gray pictures of 16 bits as white."""
    header = page.with_suffix(".png").read_bytes()[:26]
    depth, color_type = header[24], header[25]
    assert header.startswith(b"\x89PNG") and (depth, color_type) == (8, 2)


def test_pictures_are_small():
    assert sum(path.stat().st_size for path in (ROOT / "docs").rglob("*") if path.suffix not in (".md", ".html")) < LARGEST


def known_names(path: Path) -> list[str]:
    """Names of the formats whose records are in a file."""
    records = re.findall(r"\bFormat\(\s*\"([a-z0-9]+)\"|\breplace\(\s*([A-Z]+),", path.read_text())
    return [name or constant.lower() for name, constant in records]


def declared_options(path: Path) -> list[str]:
    """Names of the fields made by `option(...)` in a file."""
    return re.findall(r"^    ([a-z_]+): \w+ = option\(", path.read_text(), flags=re.MULTILINE)


def lines_of(path: Path) -> list[str]:
    return path.read_text().splitlines() if path.suffix == ".md" else []
