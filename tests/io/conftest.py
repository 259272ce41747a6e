"""Folders of empty files, for tests of what file names alone tell."""

import pytest


@pytest.fixture
def folder(tmp_path):
    def make(*names):
        for name in names:
            (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
            (tmp_path / name).touch()
        return tmp_path

    return make


def numbered(pattern, numbers):
    return [pattern.format(number) for number in numbers]
