"""The examples in docstrings of the core run and give what they say."""

import doctest
import importlib
import pkgutil

import pytest

from refmesh_addon import core

MODULES = [module.name for module in pkgutil.walk_packages(core.__path__, core.__name__ + ".")]


@pytest.mark.parametrize("name", MODULES)
def test_examples(name):
    failed, _ = doctest.testmod(importlib.import_module(name))
    assert not failed
