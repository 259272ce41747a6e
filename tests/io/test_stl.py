import numpy as np
import pytest
import trimesh
from numpy.testing import assert_allclose

from refmesh_addon.io.stl import parse_stl

BALL = trimesh.creation.icosphere(subdivisions=1)
BINARY, TEXT = BALL.export(file_type="stl"), BALL.export(file_type="stl_ascii").encode()
NAMED_SOLID = b"solid by an exporter".ljust(80) + BINARY[80:]


def assert_is_ball(data):
    vertices, triangles, omitted = parse_stl(data)
    assert_allclose(vertices[triangles], BALL.triangles, atol=1e-6)
    assert omitted == 0


@pytest.mark.parametrize("data", [BINARY, NAMED_SOLID, TEXT, TEXT.upper(), TEXT.replace(b"\n", b"\r\n")])
@pytest.mark.parametrize("rest", [b"", b"\0", b"\r\n", b"\x1a", b"\0" * 512])
def test_every_way_to_write_it_is_read_and_a_few_bytes_may_follow(data, rest):
    assert_is_ball(data + rest)


@pytest.mark.parametrize("data", [BINARY, NAMED_SOLID])
def test_a_binary_file_is_as_long_as_its_header_says(data):
    for wrong in (data[:-1], data[:-50]):
        with pytest.raises(ValueError, match=r"length|truncated"):
            parse_stl(wrong)
    with pytest.raises(ValueError, match="250 bytes follow the 80 triangles"):
        parse_stl(data + data[84 : 84 + 250])


def test_no_shorter_text_passes():
    for length in range(1, len(TEXT.rstrip()) - 1, 37):
        with pytest.raises(ValueError):
            parse_stl(TEXT[:length])


def test_a_facet_without_three_vertices_is_refused():
    first = TEXT.index(b"vertex")
    with pytest.raises(ValueError, match="its 80 facets have 239 vertices"):
        parse_stl(TEXT[:first] + TEXT[TEXT.index(b"\n", first) :])


def test_a_count_is_held_against_the_bytes():
    with pytest.raises(ValueError, match="declares 4294967295 triangles"):
        parse_stl(bytes(80) + np.array([2**32 - 1], "<u4").tobytes() + bytes(50))
