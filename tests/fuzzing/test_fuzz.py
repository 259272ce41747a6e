"""A few thousand damaged files of all kinds; `make fuzz` reads 100,000."""

import sys

import pytest

from .fuzz import fuzz


@pytest.mark.skipif(sys.platform == "win32", reason="limits of child processes are those of POSIX")
def test_damaged_files_are_read_or_refused_by_name():
    assert fuzz(2000, seed=0) == []
