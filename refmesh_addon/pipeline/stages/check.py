"""Every frame looked at once: what may be wrong with it, and its copy for the preview."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path

import numpy as np

from ...core.capture.diagnosis import FrameStatistics, diagnose, mesh_statistics
from ...core.errors import RefMeshError
from ...core.findings import Finding
from ...io.discovery import find_sequence
from ...io.files import output_folder
from ...io.findings import write_findings
from ...io.meshes import parse_mesh, read_bytes
from ...io.preview import PreviewMesh, preview_path, read_arrays, remove_other_previews, write_preview
from ...io.textures import missing_textures
from ..session.job import CHECK, JobSpec
from ..session.parallel import Workers

FIGURES_NAME = "figures"  # of the array in which a preview keeps the figures of its frame


def check_sequence(spec: JobSpec, notify: Callable[[str, int | None, float], None], workers: Workers) -> list[Finding]:
    """Looks at every frame that was not looked at before, and writes the findings as JSON and as text.

    A frame that cannot be read is a finding, not an error. Raises RefMeshError when there is no sequence or no place to
    write to, and what `notify` raises.
    """
    sequence = find_sequence(spec.source, spec.frames)
    output = output_folder(spec.output)
    known: dict[int, FrameStatistics] = {}
    for index, frame in enumerate(sequence.frames):
        notify(CHECK, frame.number, 0.0)
        figures = _known(frame.number, frame.path, output) if spec.resume else None
        if figures is not None:
            known[index] = figures
    waiting = [index for index in range(len(sequence.frames)) if index not in known]
    tasks = ((sequence.frames[index].number, sequence.frames[index].path, output) for index in waiting)
    for count, (task, figures) in enumerate(workers.map(look_at, tasks, lambda: notify(CHECK, None, 0.0)), start=1):
        known[waiting[task]] = figures
        notify(CHECK, figures.number, count / len(waiting))
    findings = diagnose([known[index] for index in range(len(sequence.frames))], sequence.gaps)
    remove_other_previews(output, [preview_path(output, frame.path) for frame in sequence.frames if frame.path.is_file()])
    write_findings(output, sequence, findings)
    return findings


def look_at(number: int, path: Path, output: Path) -> FrameStatistics:
    """The figures of one frame, kept with its preview; one that cannot be read has neither."""
    try:
        data = read_bytes(path)
        mesh = parse_mesh(data, path)
    except RefMeshError as error:
        return FrameStatistics(number, str(error).replace(f"{path}: ", ""))
    content = hashlib.blake2b(data, digest_size=16).hexdigest()
    figures = FrameStatistics(number, content=content, missing_textures=missing_textures(data, path), **mesh_statistics(mesh))
    entry = np.array(json.dumps(asdict(figures)))
    write_preview(preview_path(output, path), PreviewMesh.of(mesh), {FIGURES_NAME: entry})
    return figures


def _known(number: int, path: Path, output: Path) -> FrameStatistics | None:
    try:
        arrays = read_arrays(preview_path(output, path), [FIGURES_NAME])
        values = json.loads(str(arrays[FIGURES_NAME])) if arrays else None
    except (OSError, ValueError):
        return None
    if values is None:
        return None
    return FrameStatistics(**{**values, "number": number, "missing_textures": tuple(values["missing_textures"])})
