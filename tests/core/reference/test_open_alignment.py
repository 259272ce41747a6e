"""Alignment by what two views show: what it recovers, and what says nothing."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from refmesh_addon.core.reference.anchor_frame import RIM, ShownSurface
from refmesh_addon.core.reference.open_alignment import align_open

from .test_alignment import BODY, Scene, swayed

MIDDLES = BODY.vertices[BODY.triangles].mean(axis=1)
ACROSS = MIDDLES @ np.array([0.6, 0.0, 0.8])


@pytest.fixture(scope="module")
def views():
    """The anchor frame shows three quarters of a body, another frame three quarters from the other end."""
    scene, (low, high) = Scene(), np.quantile(ACROSS, [0.25, 0.75])
    scene.anchor = replace(scene.anchor, shown=ShownSurface.of(BODY, ACROSS < high, scene.spacing))
    scene.surface = np.isin(np.arange(len(BODY.vertices)), BODY.triangles[ACROSS > low])
    both = BODY.triangles[(ACROSS > low) & (ACROSS < high)]
    scene.common = np.isin(np.arange(len(BODY.vertices)), both)
    return scene


def missed(views, targets):
    """Mean distance of what both show from where it belongs."""
    return np.linalg.norm(views.frame.to(targets).vertices - BODY.vertices, axis=1)[views.common].mean()


@pytest.mark.parametrize("share", [0.1, 0.2, 0.4])
def test_a_small_deformation_is_undone_where_both_show_the_body(views, share):
    start = swayed(views.centers, share * views.spacing)
    alignment = align_open(views.frame, start, views.anchor, views.surface, 10)
    assert missed(views, alignment.targets) < 0.7 * missed(views, start)
    assert_array_equal(alignment.mesh.vertices, views.frame.to(alignment.targets).vertices)


def test_no_steps_and_no_partner_change_nothing(views):
    for start, steps in [(swayed(views.centers, 0.3 * views.spacing), 0), (views.centers + 100 * views.spacing, 3)]:
        assert_array_equal(align_open(views.frame, start, views.anchor, views.surface, steps).targets, start)


def test_partners_keep_off_the_border_and_closed_anchors_are_refused(views):
    shown = views.anchor.shown
    rim = np.quantile(ACROSS, 0.75)
    assert (shown.tree.data @ np.array([0.6, 0.0, 0.8])).max() < rim - 0.5 * RIM * views.spacing
    with pytest.raises(ValueError, match="does not say what it shows"):
        align_open(views.frame, views.centers, Scene().anchor, views.surface, 1)
