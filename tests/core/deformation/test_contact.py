"""Two bodies that touch, captured as one surface: what lies in the contact is distinguished from what can be seen."""

import numpy as np
from numpy.testing import assert_array_equal
from scipy import sparse

from refmesh_addon.core.deformation.contact import behind_contact, possible_owners
from refmesh_addon.core.geometry.winding import enclosed_by
from refmesh_addon.core.reference.mapping import bind
from tests.core.shapes import box, joined

SIDE, STEP = 1.0, 0.25


def lattice(center):
    """Centers of one cube, STEP apart."""
    along = np.arange(-SIDE / 2 + STEP / 2, SIDE / 2, STEP)
    return np.stack(np.meshgrid(along, along, along), axis=-1).reshape(-1, 3) + center


def pair(gap):
    """Two cubes side by side along x, `gap` apart: mesh, centers, which centers are of one body, and owners of the vertices."""
    places = [np.array([sign * (SIDE + gap) / 2, 0.0, 0.0]) for sign in (-1, 1)]
    mesh = joined(*(box((SIDE,) * 3, 3, place) for place in places))
    centers, body = np.concatenate([lattice(place) for place in places]), np.repeat([0, 1], 64)
    compatible = body[:, None] == body
    return mesh, centers, compatible, bind(mesh, centers, sparse.csr_matrix(compatible.astype(float)), STEP).owners


def hidden(gap, source):
    mesh, centers, compatible, owners = pair(gap)
    return mesh, behind_contact(mesh, owners, centers, compatible, enclosed_by(source), STEP)


def test_the_faces_that_touch_are_hidden_and_nothing_else_is():
    mesh, marked = hidden(0.0, box((2 * SIDE, SIDE, SIDE), 3))
    x, y, z = np.abs(mesh.vertices).T
    in_contact = x < 1e-9
    deep = in_contact & (np.maximum(y, z) < 0.4 * SIDE)
    assert deep.sum() > 20
    assert marked[deep].all()
    assert not marked[~in_contact].any()


def test_bodies_apart_hide_nothing():
    mesh, marked = hidden(0.1, pair(0.1)[0])
    assert not marked.any()


def test_one_body_hides_nothing_in_itself():
    mesh, centers, compatible, owners = pair(0.0)
    source = enclosed_by(box((2 * SIDE, SIDE, SIDE), 3))
    assert not behind_contact(mesh, owners, centers, np.ones_like(compatible), source, STEP).any()


def test_triangles_beside_the_contact_may_belong_to_either_body():
    mesh, centers, compatible, _ = pair(0.0)
    owners = possible_owners(mesh, centers, STEP)
    inner = mesh.vertices[mesh.triangles].mean(axis=1)
    bodies = np.where(compatible[0][owners], 0, 1)
    assert_array_equal(bodies[:, 0], np.repeat([0, 1], len(bodies) // 2))  # the nearest is the own one's
    either = (bodies != bodies[:, :1]).any(axis=1)
    side = (np.abs(inner[:, 1:]) > 0.49 * SIDE).any(axis=1)
    assert either[side & (np.abs(inner[:, 0]) < 0.1 * STEP)].all()
    assert not either[np.abs(inner[:, 0]) > 0.5 * STEP].any()
