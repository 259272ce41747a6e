import numpy as np
import pytest
from numpy.testing import assert_array_equal

from refmesh_addon.io.obj import library_names, obj_lines, parse_obj
from refmesh_addon.io.polygons import fan

SQUARE = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"


def faces_of(text):
    return parse_obj((SQUARE + text).encode())[1].tolist()


def slow_fan(polygons):
    return [[corners[0], corners[at], corners[at + 1]] for corners in polygons for at in range(1, len(corners) - 1)]


def test_vertices_keep_order_and_digits():
    vertices, _, _ = parse_obj(b"v 0.1 -2e-3 3 0.5 0.5 0.5\nv\t123456.789012 0 0\nv 1 1 1 # corner\nf 1 2 3\n")
    assert_array_equal(vertices, [[0.1, -2e-3, 3], [123456.789012, 0, 0], [1, 1, 1]])


@pytest.mark.parametrize(
    "face",
    [
        "f 1 2 3",
        "f 1/1 2/2 3/3",
        "f 1//1 2//1 3//1",
        "f 1/1/1 2/2/2 3/3/3",
        "  f\t1 2  3 # tri",
        "f -4 -3 -2",
        "f 1 \\\n2 3",
        "f 1 \\ \n2 \\\t\n3",
    ],
)
def test_every_way_to_write_a_face_gives_the_same_triangle(face):
    assert faces_of(face + "\n") == [[0, 1, 2]]
    assert faces_of((face + "\n").replace("\n", "\r\n")) == [[0, 1, 2]]


def test_polygons_become_fans():
    assert faces_of("f 1 2 3 4\nf 1 2 3\n") == [[0, 1, 2], [0, 2, 3], [0, 1, 2]]
    rng = np.random.default_rng(0)
    polygons = [rng.integers(0, 50, size).tolist() for size in rng.integers(3, 9, 40)]
    corners = np.concatenate([np.array(polygon) for polygon in polygons])
    assert fan(corners, np.array([len(polygon) for polygon in polygons])).tolist() == slow_fan(polygons)


def test_negative_indices_count_from_the_face():
    text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\nv 0 0 1\nv 1 0 1\nv 0 1 1\nf -3 -2 -1\n"
    assert parse_obj(text.encode())[1].tolist() == [[0, 1, 2], [3, 4, 5]]


def test_objects_groups_materials_and_seams_leave_the_vertices_alone():
    seams = "o a\nusemtl skin\nvt 0 0\nvt 1 0\nvn 0 0 1\nf 1/1/1 2/2/1 3/1/1\ng b\nusemtl cloth\nf 1/2/1 3/2/1 4/1/1\n"
    vertices, triangles, _ = parse_obj((SQUARE + seams).encode())
    assert len(vertices) == 4
    assert triangles.tolist() == [[0, 1, 2], [0, 2, 3]]


@pytest.mark.parametrize("index", ["0", "-5", "9"])
def test_indices_that_point_nowhere_stay_outside(index):
    _, triangles, _ = parse_obj((SQUARE + f"f 1 2 {index}\n").encode())
    assert not 0 <= triangles[0, 2] < 4


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("just some message\nabout meshes\n", "no vertices; is it really an OBJ"),
        ("v 0 0 0\nv 1 0\nf 1 2 1\n", "line 2 is not a vertex"),
        ("v 0 0 0\nv 1 0,5 0\nf 1 2 1\n", "line 2 is not a vertex with three coordinates: 'v 1 0,5 0'"),
        (SQUARE + "f 1 2 3\nf 1 2", "line 6, the last, is a face with fewer than three corners: 'f 1 2'; is the file truncated"),
        (SQUARE + "f 1 2 x\n", "line 5 is not a face"),
        (SQUARE + "f 1 2 99999999999999999999\n", "line 5 is not a face"),
        ("# number of triangles: 2\n" + SQUARE + "f 1 2 3\n", "truncated: its header declares 2 faces, 1 are there"),
        (SQUARE + "v 5 5 5\nf 1 2 3\nf 1 3 4", "seems truncated: no face uses 1 of its 5 vertices"),
    ],
)
def test_what_is_not_a_complete_obj_is_refused(text, message):
    with pytest.raises(ValueError, match=message):
        parse_obj(text.encode())


def test_a_missing_last_line_break_or_unused_vertices_alone_are_fine():
    assert faces_of("f 1 2 3\nf 1 3 4") == [[0, 1, 2], [0, 2, 3]]
    assert faces_of("v 5 5 5\nf 1 2 3\n") == [[0, 1, 2]]


def test_a_capture_cut_anywhere_inside_a_line_is_refused(shared_data):
    data = (shared_data("dancer") / "dancer_fr0006.obj").read_bytes()
    for cut in np.linspace(1, len(data) - 30, 12).astype(int):
        with pytest.raises(ValueError):
            parse_obj(data[:cut])


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16"])
def test_a_byte_order_mark_hides_no_vertex(encoding):
    vertices, triangles, _ = parse_obj((SQUARE + "f 1 2 3\n").encode(encoding))
    assert len(vertices) == 4
    assert triangles.tolist() == [[0, 1, 2]]


def test_degenerate_faces_are_left_out_and_counted_and_points_and_lines_ignored():
    vertices, triangles, omitted = parse_obj((SQUARE + "p 1\nl 1 2\nf 1 2\nf 1 2 3\nf 4\nl 1/1 2/2 3/3\nf\nf 1 3 4\n").encode())
    assert (len(vertices), triangles.tolist(), omitted) == (4, [[0, 1, 2], [0, 2, 3]], 3)


def test_a_comment_that_ends_with_a_backslash_hides_no_vertex():
    text = "# from C:\\captures\\\n" + SQUARE + "mtllib \\\nscan.mtl\nmtllib scan.mtl\nf 1 2 x\n"
    with pytest.raises(ValueError, match="line 9 is not a face"):
        parse_obj(text.encode())
    assert library_names(obj_lines(text.encode())) == ["scan.mtl"]
    assert len(parse_obj(text.replace("x", "3").encode()).vertices) == 4
