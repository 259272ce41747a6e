import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import scipy

from refmesh_addon.core.errors import RefMeshError
from refmesh_addon.core.evaluation.distances import Distances
from refmesh_addon.core.settings import Settings
from refmesh_addon.io.report import FrameReport, GroupReport, Report, read_report
from refmesh_addon.io.sequence import Frame, Sequence
from refmesh_addon.io.versions import versions

SEQUENCE = Sequence("walk", (Frame(6, Path("/in/walk_06.obj")), Frame(8, Path("/in/walk_08.obj"))), gaps=(7,))
GROUP = GroupReport(
    index=0,
    frames=(6, 8),
    anchor=6,
    reference="reference/group_000.ply",
    triangles=320,
    components=2,
    watertight=True,
    stress=0.01,
    iou_before=0.9,
    iou_after=0.97,
    frame_iou_before=(1.0, 0.9),
    frame_iou_after=(1.0, 0.97),
    self_intersections=0,
)
DISTANCES = Distances(mean=1e-4, rms=2e-4, p99=5e-4, max=np.float64(2e-3))
FRAME = FrameReport(6, 0, "deformed/frame_0006.ply")


def report(**changes):
    return Report(input="/in", sequence=SEQUENCE, settings=Settings(), bbox_diagonal=1.5, **changes)


def test_all_keys_that_other_tools_read_are_there(tmp_path):
    evaluated = replace(
        FRAME, held=0.1, hidden=0.2, source_to_deformed=DISTANCES, deformed_to_source=DISTANCES, d1_psnr=70.0, d2_psnr=75.0
    )
    report(seconds={"tracking": 1.23456}, groups=[GROUP], frames=[evaluated], warnings=["frame 7 is missing"]).write(tmp_path)
    data = json.loads((tmp_path / "report.json").read_text(encoding="utf-8"))
    assert data["schema"] == 1
    assert {"input", "settings", "versions", "seconds", "bbox_diagonal", "groups", "frames", "centers_playback", "warnings"} <= data.keys()
    assert data["sequence"] == {"name": "walk", "numbers": [6, 8], "gaps": [7], "files": ["walk_06.obj", "walk_08.obj"]}
    group, frame = data["groups"][0], data["frames"][0]
    for name in ("index", "frames", "anchor", "reference", "triangles", "components", "watertight", "stress", "iou_before", "iou_after"):
        assert name in group
    assert {"number", "group", "deformed", "d1_psnr", "d2_psnr"} <= frame.keys()
    assert frame["source_to_deformed"] == {"mean": 1e-4, "rms": 2e-4, "p99": 5e-4, "max": 2e-3}


def test_what_is_not_made_yet_is_left_out():
    data = report(groups=[GROUP], frames=[FRAME]).to_dict()
    assert "playback" not in data["groups"][0]
    assert data["frames"][0] == {
        "number": 6,
        "group": 0,
        "deformed": "deformed/frame_0006.ply",
        "flipped": 0.0,
        "held": 0.0,
        "hidden": 0.0,
        "absent": 0.0,
        "overstretched": 0.0,
    }


def test_settings_of_a_report_make_the_same_run_again(tmp_path):
    settings = Settings.from_flat({"centers": 64, "mapping": "rbf"})
    Report("/in", SEQUENCE, settings).write(tmp_path)
    assert Settings.from_flat(read_report(tmp_path)["settings"]) == settings


@pytest.mark.parametrize("change", [{"source_to_deformed": Distances(float("nan"), 0, 0, 0)}, {"d1_psnr": float("inf")}])
def test_a_figure_that_is_not_finite_is_an_error(tmp_path, change):
    with pytest.raises(ValueError, match="JSON"):
        report(frames=[FrameReport(6, 0, "d.ply", **change)]).write(tmp_path)


def test_versions_are_those_in_use():
    present = versions()
    assert present["numpy"] == np.__version__
    assert present["scipy"] == scipy.__version__
    assert {"refmesh", "python", "trimesh"} <= present.keys()


@pytest.mark.parametrize(
    ("text", "message"), [(None, "no results there"), ("{", "damaged"), ("[]", "damaged"), ('{"schema": 0}', "another version")]
)
def test_reports_that_cannot_be_used_are_refused_by_name(tmp_path, text, message):
    if text is not None:
        (tmp_path / "report.json").write_text(text)
    with pytest.raises(RefMeshError, match=rf"report\.json: .*{message}"):
        read_report(tmp_path)
