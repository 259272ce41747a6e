"""Reports from elsewhere: types, ranges, and paths that stay inside the folder."""

import copy
import json

import numpy as np
import pytest

from refmesh_addon.core.errors import RefMeshError
from refmesh_addon.core.settings import Settings
from refmesh_addon.io.report import FarPlace, FrameReport, GroupReport, Report, read_report
from refmesh_addon.io.sequence import Frame, Sequence

ELSEWHERE = ["/etc/passwd", "../secret.ply", "reference/../../secret.ply", "C:\\secret.ply", "\\\\host\\share", "//host/share"]
ELSEWHERE += ["a\0b", "", 3, []]


@pytest.fixture
def valid(tmp_path):
    frames = tuple(Frame(number, tmp_path / f"f_{number}.obj") for number in (1, 2))
    report = Report(str(tmp_path), Sequence("f", frames), Settings(), 2.0, centers_playback="playback/centers-0.pc2")
    report.groups.append(
        GroupReport(0, (1, 2), 1, "reference/group_000.ply", 80, 1, True, 0.1, 0.9, 0.95, (0.9,) * 2, (0.95,) * 2, 0, "playback/a.pc2")
    )
    report.frames += [FrameReport(number, 0, f"deformed/frame_{number:04d}.ply") for number in (1, 2)]
    report.far_places.append(FarPlace(2, "extra", 0.4, (1.0, 0.0, 0.0), 0.03))
    report.write(tmp_path)
    return tmp_path


def changed(folder, change):
    data = json.loads((folder / "report.json").read_text())
    change(data)
    (folder / "report.json").write_text(json.dumps(data))
    return folder


def test_what_is_written_is_read(valid):
    assert read_report(valid)["groups"][0]["reference"] == "reference/group_000.ply"


@pytest.mark.parametrize("path", ELSEWHERE)
@pytest.mark.parametrize("place", [("groups", 0, "reference"), ("groups", 0, "playback"), ("frames", 1, "deformed"), ("centers_playback",)])
def test_paths_that_lead_elsewhere_are_refused(valid, path, place):
    def change(data):
        for key in place[:-1]:
            data = data[key]
        data[place[-1]] = path

    with pytest.raises(RefMeshError, match=r"report\.json: the report is damaged \(.*" + place[-1]):
        read_report(changed(valid, change))


def test_a_link_out_of_the_folder_is_refused(valid, tmp_path_factory):
    (valid / "deformed").symlink_to(tmp_path_factory.mktemp("elsewhere"))
    with pytest.raises(RefMeshError, match="leads out of the folder"):
        read_report(valid)


def places(value, path=()):
    """The path of every value in nested JSON."""
    yield path
    for key, member in value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ():
        yield from places(member, (*path, key))


def test_no_damaged_report_gives_anything_but_a_report_or_a_refusal(valid):
    data, rng = json.loads((valid / "report.json").read_text()), np.random.default_rng(1)
    known = [path for path in places(data) if path]
    others = [None, True, -1, 1e308, "x", "../y", [], {}, [[]], {"a": 1}, 10**30, [None]]
    for _ in range(600):
        damaged = copy.deepcopy(data)
        *path, last = known[rng.integers(len(known))]
        holder = damaged
        for key in path:
            holder = holder[key]
        if rng.random() < 0.2:
            del holder[last]
        else:
            holder[last] = others[rng.integers(len(others))]
        (valid / "report.json").write_text(json.dumps(damaged))
        try:
            report = read_report(valid)
        except RefMeshError as refusal:
            assert str(refusal).startswith(str(valid))
        else:
            assert all(".." not in frame["deformed"] for frame in report["frames"])
            assert all(isinstance(number, int) for group in report["groups"] for number in group["frames"])


def test_deeply_nested_json_is_refused(valid):
    (valid / "report.json").write_text("[" * 100_000)
    with pytest.raises(RefMeshError, match="the report is damaged"):
        read_report(valid)


@pytest.mark.parametrize("position", [[1.0, 2.0], [1.0, 2.0, "x"], None])
def test_a_place_without_three_numbers_is_refused(valid, position):
    with pytest.raises(RefMeshError, match="far_places"):
        read_report(changed(valid, lambda data: data["far_places"][0].__setitem__("position", position)))


@pytest.mark.parametrize(
    "change",
    [
        lambda data: data["groups"][0].update(frames=[]),
        lambda data: data["groups"][0].update(index=1),
        lambda data: data["frames"][0].update(number=2),
        lambda data: data["settings"].update(centers="many"),
        lambda data: data["settings"].update(texture=[]),
    ],
)
def test_entries_that_refer_to_nothing_and_wrong_settings_are_refused(valid, change):
    with pytest.raises(RefMeshError, match=r"report\.json: the report is damaged"):
        read_report(changed(valid, change))
