"""Whether a run would change anything: settings, frames and results as they were when the results were loaded."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path

import bpy

from ...core.settings import STAGES
from ...io.report import REPORT_NAME
from ..scene.paths import absolute_path
from .missing import missing_files
from .restoring import all_fit
from .status import changes_of, known_results

DIGEST_BYTES = 16


def fingerprint(owner: bpy.types.Object, results: Path) -> str:
    """Digest of name, size and times of all frames and of the report; "" where one is missing or a frame is newer than the report."""
    try:
        frames = [_stamp(absolute_path(owner, frame.path)) for frame in owner.refmesh.frames]
        report = _stamp(results / REPORT_NAME)
    except OSError:
        return ""
    if max(frame[-1] for frame in frames) > report[-1]:
        return ""
    return hashlib.blake2b(json.dumps([frames, report]).encode(), digest_size=DIGEST_BYTES).hexdigest()


def is_up_to_date(owner: bpy.types.Object, stage: str, settings: dict[str, object], frames: str, results: Path) -> bool:
    """Whether a run up to `stage`, with these settings and this selection of frames, into `results`, would find everything there."""
    state = owner.refmesh
    if stage not in STAGES or stage not in state.done or results != absolute_path(owner, state.output):
        return False
    if missing_files(owner) or not all_fit(owner):
        return False
    known = known_results(state)
    if not known.get("inputs") or known["inputs"] != fingerprint(owner, results):
        return False
    return not changes_of(known, stage, settings, frames)


def _stamp(path: Path) -> tuple[str, int, int, int]:
    """The time of the last change of the file itself comes along: that of its content can be set to what it was before."""
    status = path.stat()
    return path.name, status.st_size, status.st_ctime_ns, status.st_mtime_ns
