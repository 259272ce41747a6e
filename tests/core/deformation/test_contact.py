"""Two bodies that touch, captured as one surface: what lies in the contact is distinguished from what can be seen."""

import numpy as np
from numpy.testing import assert_array_equal
from scipy import sparse

from refmesh_addon.core.deformation.arap import ArapSolver
from refmesh_addon.core.deformation.contact import behind_contact, faced, possible_owners
from refmesh_addon.core.deformation.correspondence import Correspondence
from refmesh_addon.core.deformation.surface_fit import fit_surface
from refmesh_addon.core.deformation.surface_samples import SurfaceSampler
from refmesh_addon.core.geometry.closest_point import SurfaceIndex
from refmesh_addon.core.geometry.mesh import vertex_normals
from refmesh_addon.core.geometry.stretch import RestShape
from refmesh_addon.core.geometry.winding import enclosed_by
from refmesh_addon.core.reference.mapping import bind
from refmesh_addon.core.types import TriangleMesh
from tests.core.shapes import ball, box, joined

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


def walls():
    """Two parts of one body that touch, as a deformed reference has them, the surface that a capture has of them, and their walls.

    The third result marks the vertices in the contact.
    """
    mesh = pair(0.02)[0]
    x, y, z = np.abs(mesh.vertices).T
    return mesh, box((2 * SIDE + 0.02, SIDE, SIDE), 4), (x < 0.02) & (np.maximum(y, z) < 0.45 * SIDE)


def test_the_walls_of_a_contact_face_each_other_and_the_sides_of_a_plate_do_not():
    mesh, source, wall = walls()
    depths = SurfaceIndex(source).query(mesh.vertices).distances
    inside = wall & (depths > 0.1)
    assert inside.sum() > 50
    assert faced(mesh.vertices[inside], vertex_normals(mesh)[inside], depths[inside], SurfaceIndex(mesh)).all()
    plate = box((SIDE, SIDE, 0.1), 3)
    sunk = plate.moved(plate.vertices - [0, 0, 0.05])  # in the source, which is the plate in its place
    upper = np.flatnonzero((plate.vertices[:, 2] > 0.04) & (np.abs(plate.vertices[:, :2]).max(axis=1) < 0.4))
    depths = np.full(len(upper), 0.05)
    assert not faced(sunk.vertices[upper], vertex_normals(sunk)[upper], depths, SurfaceIndex(sunk)).any()


def cut_off(mesh, side, rim):
    """The part of a ball on one side of x = 0, its outermost ring drawn to a circle of radius `rim` there."""
    vertices = mesh.vertices.copy()
    beyond = side * vertices[:, 0] > 0
    around = vertices[beyond] * [0, 1, 1]
    vertices[beyond] = rim * around / np.maximum(np.linalg.norm(around, axis=1, keepdims=True), 1e-9)
    return TriangleMesh(vertices, mesh.triangles[~beyond[mesh.triangles].all(axis=1)])


def test_the_walls_of_a_contact_are_not_drawn_into_its_crease():
    """Two balls that are pressed into each other: the capture shows what is outside, the reference mesh all of both."""
    offset, rim = np.array([0.93, 0.0, 0.0]), np.sqrt(1 - 0.93**2)
    mesh = joined(ball(4, center=-offset), ball(4, center=offset))
    source = joined(cut_off(ball(5, center=-offset), 1, rim), cut_off(ball(5, center=offset), -1, rim))
    fitted = fit_surface(ArapSolver(mesh), mesh.vertices, Correspondence(SurfaceIndex(source), SurfaceSampler(mesh)))
    wall = (np.linalg.norm(mesh.vertices[:, 1:], axis=1) < 0.8 * rim) & (np.abs(mesh.vertices[:, 0]) < 0.5)
    assert RestShape(mesh).stretches(fitted.vertices)[wall[mesh.triangles].all(axis=1)].max() < 1.1
    assert fitted.held[wall].all()
