"""The extension's zip, built without wheels and installed by Blender."""

import re
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest

from extension.build import PLATFORMS, ROOT, build_zip, copy_sources, with_wheels

PLATFORM = next(iter(PLATFORMS))
INSTALL = """
import sys, bpy
bpy.ops.extensions.package_install_files(filepath=sys.argv[1], repo="user_default", enable_on_install=True)
assert "bl_ext.user_default.refmesh" in bpy.context.preferences.addons.keys()
assert dir(bpy.ops.refmesh), "no operator was registered"
bpy.ops.preferences.addon_disable(module="bl_ext.user_default.refmesh")
assert not dir(bpy.ops.refmesh), "operators stay behind"
"""


@pytest.fixture(scope="module")
def archive(tmp_path_factory) -> Path:
    return build(tmp_path_factory.mktemp("first"))


def build(folder: Path) -> Path:
    copy_sources(folder / "source", PLATFORM, [])
    return build_zip(folder / "source", folder, PLATFORM)


def test_zip_holds_the_addon_and_nothing_else(archive):
    names = set(zipfile.ZipFile(archive).namelist())
    sources = {str(path.relative_to(ROOT)) for folder in ("refmesh_addon", "headless") for path in (ROOT / folder).rglob("*.py")}
    sources |= {str(path.relative_to(ROOT)) for path in (ROOT / "docs" / "panel").iterdir() if path.suffix in (".md", ".html", ".png")}
    page = ROOT / "refmesh_addon" / "io" / "web_page"
    sources |= {str(path.relative_to(ROOT)) for path in (page / "index.html", page / "viewer.js") if path.exists()}  # npm makes the last
    assert {name for name in names if not name.endswith("/")} == sources | {
        "blender_manifest.toml",
        "__init__.py",
        "CHANGELOG.md",
        "LICENSE",
        "README.md",
    }


def test_same_sources_give_the_same_bytes(archive, tmp_path):
    assert build(tmp_path).read_bytes() == archive.read_bytes()


def test_blender_installs_enables_and_disables_it(archive, tmp_path):
    environment = {"BLENDER_USER_RESOURCES": str(tmp_path), "PATH": "/usr/bin:/bin"}
    result = subprocess.run([sys.executable, "-c", INSTALL, str(archive)], capture_output=True, text=True, env=environment)
    assert result.returncode == 0, result.stderr


def test_wheels_are_listed_before_the_first_table():
    text = with_wheels((ROOT / "blender_manifest.toml").read_text(), PLATFORM, ["a-1-py3-none-any.whl"])
    manifest = tomllib.loads(text)
    assert manifest["wheels"] == ["./wheels/a-1-py3-none-any.whl"]
    assert manifest["platforms"] == [PLATFORM]
    assert "files" in manifest["permissions"]


def test_changelog_begins_with_the_version():
    version = tomllib.loads((ROOT / "blender_manifest.toml").read_text())["version"]
    assert re.findall(r"^## (\S+)", (ROOT / "CHANGELOG.md").read_text(), flags=re.MULTILINE)[0] == version


def test_readme_names_the_license_of_every_wheel():
    readme = (ROOT / "README.md").read_text()
    for lock in (ROOT / "extension").glob("*.txt"):
        for name in re.findall(r"^([a-z0-9-]+)==", lock.read_text(), flags=re.MULTILINE):
            assert re.search(rf"^\| {name} \|", readme, flags=re.MULTILINE | re.IGNORECASE), f"{name} is missing in README.md"


def test_the_zip_with_pymeshlab_has_another_name(archive, tmp_path, monkeypatch):
    """Neither overwrites the other, and the command line says which one is installed."""
    monkeypatch.setenv("WITH_PYMESHLAB", "1")
    assert build(tmp_path).name == f"{archive.stem}-pymeshlab.zip"
    monkeypatch.setenv("WITH_PYMESHLAB", "0")
    assert build(tmp_path).name == archive.name
