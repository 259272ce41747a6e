"""Which lines of its anchor frame a group has: those that its other frames show too."""

import numpy as np
import pytest
from scipy import sparse

from refmesh_addon.core.geometry.feature_lines import feature_edges
from refmesh_addon.core.reference.frame_features import FrameFeatures, SharedFeatures, frame_features
from refmesh_addon.core.reference.mapping import FrameMap

from ..shapes import ball, box, moved


def features_of(mesh):
    return FrameFeatures(mesh, feature_edges(mesh).edges.astype(np.int32))


def mapped(mesh, mapping="affinity"):
    """The features of a mesh that stays where it is, on eight centers of one body."""
    centers = 0.5 * np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    frame = FrameMap(mesh, centers, sparse.csr_matrix(np.ones((8, 8))), 0.5, mapping)
    return frame_features(frame, mesh, np.ones(len(mesh.triangles), dtype=bool))


def shared(anchor, *others):
    result = SharedFeatures(anchor, spacing=0.2)
    for frame in others:
        result.add(frame)
    return result.lines


def test_a_box_has_its_edges_a_ball_and_the_published_method_have_none():
    body = box((1.5, 1.5, 1.5), subdivisions=2)
    found = mapped(body)
    lengths = np.linalg.norm(np.diff(found.mesh.vertices[found.edges], axis=1), axis=2)
    assert lengths.sum() == pytest.approx(12 * 1.5)
    assert not len(mapped(ball(2)).edges)
    assert not len(mapped(body, "rbf").edges)


def test_lines_that_others_have_nearby_stay():
    own = features_of(box(subdivisions=2))
    others = [features_of(moved(box(subdivisions=2), shift=(0.05, 0, 0)))] * 2
    assert len(shared(own, *others).edges) == len(own.edges)


def test_lines_of_the_anchor_frame_alone_do_not_count():
    own = features_of(box(subdivisions=2))
    others = [features_of(ball(2)), features_of(ball(2)), features_of(box(subdivisions=2))]
    assert not len(shared(own, *others).edges)


def test_a_single_frame_keeps_its_lines():
    own = features_of(box(subdivisions=2))
    assert shared(own) is own
