"""Runs of the pipeline in the test's own process, and what they left on disk."""

import atexit
import json
import re
from dataclasses import replace
from functools import cache
from pathlib import Path

from refmesh_addon.core.settings import Settings
from refmesh_addon.pipeline.run import run
from refmesh_addon.pipeline.session.job import JobSpec
from refmesh_addon.pipeline.session.parallel import Workers

from .conftest import TINY


@cache
def shared_workers() -> Workers:
    """Processes that all runs of a test session share: most of a tiny run would be spent in starting its own."""
    workers = Workers()
    atexit.register(workers.close)
    return workers


def finish(source, output, notify=lambda *_: None, **changes) -> list[str]:
    """Runs a job to its end and gives its warnings. changes : of the job, or of TINY's settings by their flat names."""
    job = {name: changes.pop(name) for name in ("frames", "until", "resume", "warnings") if name in changes}
    ready = changes.pop("group_ready", lambda index: None)
    settings = Settings.from_flat({**TINY.to_flat(), **changes})
    warnings: list[str] = []
    run(replace(JobSpec(str(source), str(output), settings=settings), **job), notify, warnings.append, shared_workers(), group_ready=ready)
    return warnings


def report(output) -> dict:
    return json.loads((Path(output) / "report.json").read_text(encoding="utf-8"))


def results(output) -> dict[str, bytes]:
    """Path -> bytes of all that a run makes for others; the report without its times and the name of the folder."""
    output = Path(output)
    files = [path for path in output.rglob("*") if path.is_file() and "cache" not in path.relative_to(output).parts]
    found = {str(path.relative_to(output)): path.read_bytes() for path in files}
    found["report.json"] = json.dumps({**report(output), "seconds": None}).encode()
    return found


def cache_entries(output) -> dict[str, tuple[str, int]]:
    """Name of each cache entry without its key -> file name and time of writing; without the preview, which follows other rules."""
    folder = Path(output) / "cache"
    entries = {}
    for path in (path for path in folder.rglob("*.npz") if path.parent.name != "preview"):
        name = re.sub(r"-[0-9a-f]+\.npz$", "", str(path.relative_to(folder)))
        assert name not in entries, f"two entries of {name}"
        entries[name] = (path.name, path.stat().st_mtime_ns)
    return entries


def remade(before: dict, after: dict) -> set[str]:
    """Names of the entries that were written between two looks."""
    return {name for name, entry in after.items() if before.get(name) != entry}


def stages_of(names: set[str]) -> set[str]:
    return {name.partition("/")[0] for name in names}
