import json
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path
from types import SimpleNamespace

import pytest

from refmesh_addon.core.errors import RefMeshError
from refmesh_addon.pipeline.process.environment import PACKAGE_ROOT, python_executable, worker_environment
from refmesh_addon.pipeline.session.blender_program import BLENDER

LOOK = """
import json, numpy, scipy, trimesh, refmesh_addon
print(json.dumps([module.__file__ for module in (numpy, scipy, trimesh, refmesh_addon)]))
"""


def look(code=LOOK, cwd=None):
    result = subprocess.run(
        [python_executable(), "-c", code], env=worker_environment(), cwd=cwd, capture_output=True, text=True, check=True
    )
    return json.loads(result.stdout)


def test_a_worker_finds_the_packages_of_its_parent(tmp_path):
    *packages, own = look(cwd=tmp_path)
    assert [Path(file) for file in packages] == [Path(find_spec(name).origin) for name in ("numpy", "scipy", "trimesh")]
    assert Path(own) == PACKAGE_ROOT / "refmesh_addon" / "__init__.py"


def test_a_file_in_the_current_folder_is_not_taken_for_a_package(tmp_path, monkeypatch):
    (tmp_path / "numpy.py").write_text("raise SystemExit('wrong numpy')")
    monkeypatch.chdir(tmp_path)
    assert look()


def test_variables_that_mislead_python_are_left_out(monkeypatch):
    monkeypatch.setenv("PYTHONHOME", "/nowhere")
    monkeypatch.setenv("REFMESH_TEST", "kept")
    environment = worker_environment()
    assert "PYTHONHOME" not in environment
    assert environment["REFMESH_TEST"] == "kept"
    assert look()


def test_a_program_that_is_not_python_is_replaced_by_the_python_beside_it(monkeypatch, tmp_path):
    blender = tmp_path / "blender"
    blender.touch()
    for executable in ("", str(blender)):
        monkeypatch.setattr(sys, "executable", executable)
        found = subprocess.run(
            [python_executable(), "-c", "import sys; print(*sys.version_info[:2])"], capture_output=True, text=True, check=True
        )
        assert found.stdout.split() == [str(part) for part in sys.version_info[:2]]


def test_no_python_at_all_is_told_in_words(monkeypatch, tmp_path):
    monkeypatch.setattr(sys, "executable", "")
    for name in ("prefix", "exec_prefix", "base_prefix"):
        monkeypatch.setattr(sys, name, str(tmp_path))
    with pytest.raises(RefMeshError, match="no Python executable found"):
        python_executable()


@pytest.mark.parametrize(("binary", "given", "expected"), [("/b/blender", None, "/b/blender"), ("/b/blender", "", ""), ("", None, None)])
def test_a_worker_knows_the_blender_that_it_works_for(monkeypatch, binary, given, expected):
    """Not where bpy is a package; and what a person has set stays."""
    monkeypatch.setitem(sys.modules, "bpy", SimpleNamespace(app=SimpleNamespace(binary_path=binary)))
    monkeypatch.delenv(BLENDER, raising=False)
    if given is not None:
        monkeypatch.setenv(BLENDER, given)
    assert worker_environment().get(BLENDER) == expected
