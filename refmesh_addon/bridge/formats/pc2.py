"""Reference mesh and point cache of each group, as they are in the output folder."""

from __future__ import annotations

from pathlib import Path

from ...io.formats import Format
from ...io.pc2 import pc2_shape, read_pc2, write_pc2
from ...io.ply import read_surface, write_ply
from ...io.report import read_report
from ..results.corrections import active_corrections
from ..scene.playback import cache_path
from .export import Export
from .files import check_result, copy_result


def write(export: Export) -> list[Path]:
    """A .pc2 and a .ply for each group. Samples that are not chosen are left out."""
    written = []
    report = read_report(export.results)
    for index, frames in export.choice.groups.items():
        group, stem = report["groups"][index], f"{export.name}_group_{index:03d}"
        samples = [frame - export.owner.refmesh.groups[index].start for frame in frames]
        written.append(_copy_samples(_cache(export, index, group), export.file(f"{stem}.pc2"), samples))
        written.append(_copy_reference(export.results / group["reference"], export.file(f"{stem}.ply"), report.get("offset", [])))
    return written


def _cache(export: Export, index: int, entry: dict) -> Path:
    """What the group plays: the point cache of the results, or the one with corrections."""
    group = export.owner.refmesh.groups[index]
    return cache_path(group.deformed) if active_corrections(group) else export.results / entry["playback"]


def _copy_reference(source: Path, target: Path, offset: list[float]) -> Path:
    """The reference mesh about the offset of the point cache, which its header names; the file as it is near the origin."""
    if not any(offset):
        return copy_result(source, target)
    mesh = read_surface(source)
    place = " ".join(f"{value:.17g}" for value in offset)
    write_ply(target, mesh.moved(mesh.vertices - offset), comment=f"offset {place} is to be added to the positions here and in the .pc2")
    return target


def _copy_samples(cache: Path, target: Path, samples: list[int]) -> Path:
    """Copies some samples of a point cache, whose last one is held beyond its end; the file as it is when it is all of them."""
    check_result(cache)
    count, points = pc2_shape(cache)
    chosen = {min(index, count - 1) for index in samples}
    if len(chosen) == count:
        return copy_result(cache, target)
    write_pc2(target, (sample for index, sample in enumerate(read_pc2(cache)) if index in chosen), points, len(chosen))
    return target


FORMAT = Format("pc2", "Point Cache (PC2)", (".pc2",), write=write, contents="Reference mesh (PLY) and point cache (PC2) of each group")
