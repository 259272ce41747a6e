"""Two boxes that touch and move as one throughout: one body to the tracker, two where a person has marked them."""

import numpy as np
import pytest
import trimesh
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from refmesh_addon.core.errors import RefMeshError
from refmesh_addon.core.geometry.mesh import component_volumes, vertex_components
from refmesh_addon.core.types import TriangleMesh
from refmesh_addon.io.meshes import read_mesh

from ..running import cache_entries, finish, remade, report, results, stages_of

NUMBERS = (7, 8)
SIZES = {"centers": 300, "resolution": 40, "triangles": 1500}
FAR = "of the diagonal from the source"  # of single vertices on edges that the capture cuts off, with so few triangles
LARGE, SMALL = 2.0 * 2.0 * 1.0, 1.0 * 1.0 * 0.9  # volumes


def placed(points, number: int) -> np.ndarray:
    """The common motion of both boxes."""
    turn = Rotation.from_rotvec([0.0, 0.0, 0.2 * (number - NUMBERS[0])]).as_matrix()
    return np.asarray(points, dtype=float) @ turn.T + [0.3 * (number - NUMBERS[0]), 0.0, 0.0]


MARKS = "8: {} | {}".format(*(" ".join(map(str, placed([place], 8)[0])) for place in ((-0.6, -0.6, 0.5), (0.0, 0.0, 1.6))))


@pytest.fixture(scope="module")
def boxes(tmp_path_factory):
    """A small box that stands on a large one, as a capture shows them: one surface, other vertices in each frame."""
    folder = tmp_path_factory.mktemp("boxes")
    field = lambda p: np.minimum(box_distance(p, (0, 0, 0.5), (1, 1, 0.5)), box_distance(p, (0, 0, 1.45), (0.5, 0.5, 0.45)))
    from sample_scenes.generators.surface import iso_surface

    for number in NUMBERS:
        mesh = iso_surface(field, np.array([0.0, 0.0, 0.95]), 2.2, 0.14, np.random.default_rng(number))
        trimesh.Trimesh(placed(mesh.vertices, number), mesh.triangles, process=False).export(folder / f"boxes_{number:03d}.obj")
    return folder


def box_distance(points, center, half_sides) -> np.ndarray:
    beyond = np.abs(points - center) - half_sides
    return np.linalg.norm(np.maximum(beyond, 0.0), axis=1) + np.minimum(beyond.max(axis=1), 0.0)


@pytest.fixture(scope="module")
def runs(boxes, tmp_path_factory):
    """Output folder of a run without marks and of one with them, that one taking up from the first; what the second made anew."""
    plain, marked = (tmp_path_factory.mktemp(name) / "out" for name in ("plain", "marked"))
    finish(boxes, plain, **SIZES)
    finish(boxes, marked, until="tracking", **SIZES)
    before = cache_entries(marked)
    warnings = finish(boxes, marked, apart=MARKS, **SIZES)
    return plain, marked, remade(before, cache_entries(marked)), warnings


def reference(output) -> TriangleMesh:
    (group,) = report(output)["groups"]
    return read_mesh(output / group["reference"])


def test_motion_alone_cannot_tell_them_apart(runs):
    assert vertex_components(reference(runs[0]))[0] == 1


def test_marked_they_are_two_closed_bodies_of_their_own_volumes(runs):
    _, marked, _, warnings = runs
    mesh = reference(marked)
    count, piece = vertex_components(mesh)
    assert count == 2 and report(marked)["groups"][0]["watertight"]
    assert not [text for text in warnings if FAR not in text]
    assert_allclose(sorted(component_volumes(mesh, piece)), [SMALL, LARGE], rtol=0.15)
    low, high = (mesh.vertices[piece == kind] for kind in np.argsort([mesh.vertices[piece == kind][:, 2].mean() for kind in (0, 1)]))
    assert high[:, 2].min() > low[:, 2].max()  # nothing of one reaches into the other


def test_only_reference_and_what_follows_are_made_anew(runs):
    assert stages_of(runs[2]) <= {"reference", "deformation", "evaluation", "color"}


def test_deformed_each_box_is_back_where_it_was(runs):
    """Of each deformed frame, the pieces lie where the boxes were, and touch again."""
    _, marked, _, _ = runs
    count, piece = vertex_components(reference(marked))
    for frame in report(marked)["frames"]:
        vertices = placed_back(read_mesh(marked / frame["deformed"]).vertices, frame["number"])
        small = min(range(count), key=lambda kind: -vertices[piece == kind][:, 2].mean())
        upper, lower = vertices[piece == small], vertices[piece != small]
        assert np.abs(upper[:, :2]).max() < 0.62 and upper[:, 2].min() > 0.7
        assert np.abs(lower[lower[:, 2] > 1.1, :2]).max(initial=0.0) < 0.6  # what no camera saw stays inside the other
        assert frame["source_to_deformed"]["mean"] < 0.005


def placed_back(points: np.ndarray, number: int) -> np.ndarray:
    turn = Rotation.from_rotvec([0.0, 0.0, 0.2 * (number - NUMBERS[0])]).as_matrix()
    return (points - [0.3 * (number - NUMBERS[0]), 0.0, 0.0]) @ turn


def test_other_marks_of_the_same_bodies_change_nothing(runs, boxes):
    _, marked, _, _ = runs
    before, made = results(marked), cache_entries(marked)
    more = MARKS.replace(" | ", ", {} {} {} | ".format(*placed([(-0.62, -0.6, 0.52)], 8)[0]))
    finish(boxes, marked, apart=more, **SIZES)
    assert remade(made, cache_entries(marked)) == set()
    assert {name for name, data in results(marked).items() if before[name] != data} == {"report.json"}  # which holds the settings


def test_one_body_alone_is_said_and_changes_nothing(runs, boxes, tmp_path):
    warnings = finish(boxes, tmp_path / "out", apart=MARKS.split("|")[0], until="reference", **SIZES)
    assert any("only one body is marked" in words for words in warnings)
    assert vertex_components(reference(tmp_path / "out"))[0] == 1


@pytest.mark.parametrize(
    "marks, words",
    [
        (MARKS.replace("8:", "12:"), "bodies are marked in frame 12, which is not part of the job; mark them in one of 7-8"),
        ("8: 0 0 50 | 0 0 1.5", r"frame 8: the point \(0, 0, 50\) lies outside the volume"),
        (MARKS.partition("|")[0] + "|" + MARKS.partition(":")[2].partition("|")[0], "two bodies are marked at"),
        ("8: 0 0 | 0 0 1", "'0 0' is not a point"),
    ],
)
def test_marks_that_mean_nothing_are_refused(boxes, tmp_path, marks, words):
    with pytest.raises(RefMeshError, match=words):
        finish(boxes, tmp_path / "out", apart=marks, **SIZES)
