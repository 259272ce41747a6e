"""What is said about packages, with real packages that are missing, broken or old on the path of a real Python."""

import sys

import pytest

from refmesh_addon.pipeline.process import packages
from refmesh_addon.pipeline.process.packages import (
    NEEDED,
    check_packages,
    how_to_install,
    import_problem,
    missing_names,
    missing_packages,
)


@pytest.fixture
def stand_in(tmp_path, monkeypatch):
    """stand_in(name, code): a package of that name and code which is found before the real one."""
    monkeypatch.syspath_prepend(str(tmp_path))

    def write(name, code):
        (tmp_path / name).mkdir()
        (tmp_path / name / "__init__.py").write_text(code)
        monkeypatch.delitem(sys.modules, name, raising=False)

    return write


def test_a_whole_installation_has_every_package_and_no_trouble():
    versions, troubles = check_packages()
    assert list(versions) == list(NEEDED)
    assert troubles == []
    missing_names.cache_clear()
    assert missing_packages() == ()


@pytest.mark.parametrize(
    ("code", "words"),
    [
        ("raise ImportError('libm.so.6: version GLIBC_2.99 not found')", "cannot be loaded (ImportError: libm.so.6: version GLIBC_2.99"),
        ("try: 1 / 0\nexcept ZeroDivisionError as e: raise ImportError('broken?') from e", "cannot be loaded (ZeroDivisionError"),
        ("import os; os.abort()", "Python ended with exit code"),
        ("__version__ = '1.4.0rc1'", "is version 1.4.0rc1, at least"),
        ("import surely_missing", "cannot be loaded (ModuleNotFoundError: No module named 'surely_missing')"),
    ],
)
def test_what_does_not_load_is_named_with_the_reason_and_what_does_not_work(stand_in, code, words):
    stand_in("scipy", code)
    versions, troubles = check_packages()
    (trouble,) = [trouble for trouble in troubles if "'scipy'" in trouble]
    assert words in trouble
    assert NEEDED["scipy"][1] in trouble


def test_a_package_that_is_not_there_is_missing(monkeypatch):
    monkeypatch.setitem(NEEDED, "no_such_package", ("1.0", "this test does not work"))
    missing_names.cache_clear()
    assert missing_packages() == ("Python package 'no_such_package' is missing: this test does not work",)
    missing_names.cache_clear()
    assert check_packages()[1] == ["'no_such_package' is missing: this test does not work"]


def test_a_failed_import_says_which_package_or_why():
    assert "'scipy' is missing. Install" in import_problem(ModuleNotFoundError("No module named 'scipy.sparse'", name="scipy.sparse"))
    try:
        try:
            raise OSError("libc is too old")
        except OSError as reason:
            raise ImportError("seems broken") from reason
    except ImportError as error:
        assert "cannot be loaded: libc is too old" in import_problem(error)


@pytest.mark.parametrize(("text", "numbers"), [("1.15.3", (1, 15, 3)), ("2.0.0rc1", (2, 0)), ("", ())])
def test_versions_are_compared_by_their_numbers(text, numbers):
    assert packages._numbers(text) == numbers


@pytest.mark.parametrize(
    ("system", "said"),
    [
        ("ID=debian\n", "sudo apt install python3-scipy python3-pil'; with pip, 'xatlas', which the distribution does not have"),
        ('ID=ubuntu\nID_LIKE="debian"\n', "sudo apt install python3-scipy python3-pil"),
        ('ID="nobara"\nID_LIKE="rhel centos fedora"\n', "sudo dnf install python3-scipy python3-pillow"),
        ("ID=arch\n", "sudo pacman -S python-scipy python-pillow"),
        ("", "Install the RefMesh zip for this system"),
        ("ID=unheard-of\n", "Install the RefMesh zip for this system"),
    ],
)
def test_how_to_get_packages_is_said_in_the_words_of_the_distribution(system, said):
    assert said in how_to_install(["scipy", "PIL", "xatlas"], system)
