import numpy as np
import pytest
import trimesh
from numpy.testing import assert_allclose, assert_array_equal

from refmesh_addon.io.ply_surface import parse_ply_surface
from refmesh_addon.io.polygons import strip_triangles

CORNERS = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (2, 2, 2)]
POLYGONS = [(0, 1, 2, 3), (0, 1, 4), (1, 2, 3, 4), (0, 1)]
TRIANGLES = [(0, 1, 2), (0, 2, 3), (0, 1, 4), (1, 2, 3), (1, 3, 4)]
TYPES = {"char": "i1", "uint8": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint32": "u4", "float": "f4", "float64": "f8"}
LENGTHS = {name: kind for name, kind in TYPES.items() if not kind.startswith("f")}


def written(form, position="float", length="uchar", index="int", elements=("vertex", "face"), break_line="\n"):
    """A PLY of CORNERS and POLYGONS with a normal, a flag behind each face and other elements, in an order of the elements."""
    lists = {"uchar": "u1"} | LENGTHS
    extra = [f"property {position} x", "property double ny", f"property {position} y", f"property {position} z"]
    heads = {
        "vertex": [f"element vertex {len(CORNERS)}", *extra],
        "face": [f"element face {len(POLYGONS)}", f"property list {length} {index} vertex_indices", "property uchar flags"],
        "edge": ["element edge 2", "property int vertex1", "property list uchar float weights"],
        "camera": ["element camera 1", "property float view_px"],
    }
    rows = {
        "vertex": [[(TYPES[position], x), ("f8", 0.5), (TYPES[position], y), (TYPES[position], z)] for x, y, z in CORNERS],
        "face": [[(lists[length], len(face)), *((TYPES[index], corner) for corner in face), ("u1", 7)] for face in POLYGONS],
        "edge": [[("i4", 0), ("u1", 2), ("f4", 0.5), ("f4", 0.25)], [("i4", 1), ("u1", 0)]],
        "camera": [[("f4", 1.5)]],
    }
    head = ["ply", f"format {form} 1.0", "comment by hand", "obj_info nothing", *(line for name in elements for line in heads[name])]
    body = [row for name in elements for row in rows[name]]
    text = break_line.join([*head, "end_header", ""]).encode()
    if form == "ascii":
        return text + break_line.join(" ".join(f"{value:g}" for _, value in row) for row in body).encode()
    order = "<" if "little" in form else ">"
    return text + b"".join(np.array(value).astype(order + kind).tobytes() for row in body for kind, value in row)


def assert_right(data):
    vertices, triangles, omitted = parse_ply_surface(data)
    assert_array_equal(vertices, CORNERS)
    assert_array_equal(triangles, TRIANGLES)
    assert omitted == 1


FORMS = ("ascii", "binary_little_endian", "binary_big_endian")


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("kind", TYPES)
def test_every_type_of_position_index_and_length(form, kind):
    assert_right(written(form, position=kind))
    if kind in LENGTHS:
        assert_right(written(form, length=kind))
        assert_right(written(form, index=kind))


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("elements", [("face", "vertex"), ("edge", "vertex", "camera", "face"), ("vertex", "face", "edge")])
@pytest.mark.parametrize("break_line", ["\n", "\r\n", "\r"])
def test_elements_in_any_order_and_others_beside_them(form, elements, break_line):
    assert_right(written(form, elements=elements, break_line=break_line))


def test_rows_of_text_may_be_broken_anywhere():
    head, _, body = written("ascii").partition(b"end_header\n")
    assert_right(head + b"end_header\n" + b"\n".join(body.split()))


@pytest.mark.parametrize("form", FORMS)
def test_no_shorter_file_passes(form):
    data = written(form)
    for length in range(len(data) - 1):
        if form == "ascii" and data[length:].strip() and not data[length - 1 : length + 1].split()[0:1] == []:
            if len(data[:length].split()) == len(data.split()):
                continue  # the last number alone is shorter: nothing tells
        with pytest.raises(ValueError):
            parse_ply_surface(data[:length])


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("count", [10**9, 10**17])
def test_counts_are_held_against_the_bytes(form, count):
    for name in ("vertex 5", "face 4"):
        with pytest.raises(ValueError, match="truncated"):
            parse_ply_surface(written(form).replace(f"element {name}".encode(), f"element {name.split()[0]} {count}".encode()))


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (b"property float x", b"property quad x", "a property that PLY does not know: 'property quad x'"),
        (b"list uchar int", b"list float int", "a property that PLY does not know"),
        (b"element face 4", b"element face four", "an element without a count"),
        (b"ascii", b"utf-8", "its format 'utf-8' is none of PLY's three"),
        (b"property float z", b"property float w", "no vertices with x, y and z"),
        (b"\n4 0 1 2 3", b"\n-4 0 1 2 3", "'-4' is not the length of a list"),
    ],
)
def test_what_is_no_ply_is_refused(old, new, message):
    data = written("ascii")
    assert old in data
    with pytest.raises(ValueError, match=message):
        parse_ply_surface(data.replace(old, new))


def slow_strips(strips):
    triangles = []
    for strip in strips:
        part = []
        for corner in strip:
            part = [] if corner < 0 else [*part, corner]
            if len(part) > 2:
                a, b, c = part[-3:] if len(part) % 2 else (part[-2], part[-3], part[-1])
                triangles += [[a, b, c]] if len({a, b, c}) == 3 else []
    return triangles


def test_strips_are_turned_every_second_time_and_begin_anew_after_a_break():
    rng = np.random.default_rng(4)
    strips = [rng.integers(-1, 9, size).tolist() for size in [0, 1, 2, *rng.integers(3, 30, 40)]]
    corners = np.concatenate([np.array(strip, dtype=np.int64) for strip in strips])
    assert strip_triangles(corners, np.array([len(strip) for strip in strips])).tolist() == slow_strips(strips)
    assert strip_triangles(np.empty(0, np.int64), np.empty(0, np.int64)).shape == (0, 3)


def test_a_file_of_strips_gives_a_grid():
    x, y = np.meshgrid(np.arange(5.0), np.arange(4.0))
    vertices = np.column_stack([x.ravel(), y.ravel(), 0 * x.ravel()])
    strip = [corner for row in range(3) for column in range(5) for corner in (row * 5 + column, row * 5 + 5 + column)]
    strip = [corner for at, corner in enumerate(strip) for corner in ([-1, corner] if at % 10 == 0 and at else [corner])]
    head = "ply\nformat ascii 1.0\nelement vertex 20\nproperty float x\nproperty float y\nproperty float z\nelement tristrips 1\n"
    rows = [" ".join(f"{value:g}" for value in vertex) for vertex in vertices]
    body = "\n".join([*rows, f"{len(strip)} " + " ".join(map(str, strip))])
    data = (head + "property list int int vertex_indices\nend_header\n" + body).encode()
    found, triangles, _ = parse_ply_surface(data)
    normals = np.cross(found[triangles[:, 1]] - found[triangles[:, 0]], found[triangles[:, 2]] - found[triangles[:, 0]])
    assert_array_equal(normals, np.tile([0, 0, -1], (24, 1)))


@pytest.mark.parametrize("encoding", ["ascii", "binary"])
def test_what_trimesh_writes_is_read_as_it_was(encoding):
    ball = trimesh.creation.icosphere(subdivisions=2)
    vertices, triangles, _ = parse_ply_surface(ball.export(file_type="ply", encoding=encoding))
    assert_allclose(vertices, ball.vertices, atol=1e-6)
    assert_array_equal(triangles, ball.faces)
