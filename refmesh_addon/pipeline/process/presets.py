"""The presets as far as the installed packages allow."""

from __future__ import annotations

from functools import lru_cache
from importlib.util import find_spec

from ...core.presets import PRESETS
from ...core.settings import Settings

REFERENCE_IMPLEMENTATION = "pymeshlab"  # name of the package, and of the choice of --reconstruction that needs it


def preset_settings(name: str) -> Settings:
    """The settings of a preset. Where PyMeshLab is missing, none asks for it."""
    return Settings.from_flat({**PRESETS[name], **({"reconstruction": "builtin"} if preset_warning(name) else {})})


def preset_warning(name: str) -> str:
    """What the preset has to do without here, in one sentence; "" when it is complete."""
    if PRESETS[name].get("reconstruction") != REFERENCE_IMPLEMENTATION or _is_installed():
        return ""
    return (
        f"preset '{name}': PyMeshLab is not installed, so RefMesh's own surface reconstruction stands in for the published one; "
        "install an extension zip built with PyMeshLab for the latter"
    )


@lru_cache(maxsize=1)  # the panel asks at every redraw
def _is_installed() -> bool:
    return find_spec(REFERENCE_IMPLEMENTATION) is not None
