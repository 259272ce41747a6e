"""Python processes that import the same packages as this one."""

from __future__ import annotations

import os
import sys


def site_flags() -> list[str]:
    """Flags of the command line: without the packages of its own where this process is without them."""
    return ["-S"] if sys.flags.no_site else []


def same_path() -> dict[str, str]:
    """The environment variables of this process, with its import path."""
    return {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
