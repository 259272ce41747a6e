"""How long operators and panels of ours hold the window, and which exceptions leave them."""

from __future__ import annotations

import time
import traceback
from collections import defaultdict

import bpy

troubles: set[str] = set()  # exceptions that left an operator or a panel of ours
held: dict[str, float] = defaultdict(float)  # what of ours -> the longest time that it held the window, seconds


def measure_ours() -> None:
    """Every operator and panel of ours notes how long it holds the window."""
    for name in dir(bpy.types):
        cls = getattr(bpy.types, name)
        if name.startswith("REFMESH_"):
            for method in ("execute", "modal", "draw", "draw_header", "draw_header_preset"):
                if hasattr(cls, method) and callable(getattr(cls, method)):
                    setattr(cls, method, timed(f"{name}.{method}", getattr(cls, method)))


def timed(name: str, function):
    """Blender counts the arguments of a method, so the wrapper names as many."""

    def measured(*arguments):
        start = time.perf_counter()
        try:
            return function(*arguments)
        except Exception:
            troubles.add(f"{name}: {traceback.format_exc().splitlines()[-1]}")
            raise
        finally:
            held[name] = max(held[name], time.perf_counter() - start)

    if name.endswith(".modal"):
        return lambda self, context, event: measured(self, context, event)
    return lambda self, context: measured(self, context)
