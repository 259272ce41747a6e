import pytest

from refmesh_addon.core.compression.group import GroupShape
from refmesh_addon.core.errors import RefMeshError
from refmesh_addon.io.refmesh_stream.layout import (
    HEAD,
    Entry,
    GroupHead,
    group_head,
    index_place,
    packed_head,
    packed_index,
    unpacked_index,
)

SHAPE = GroupShape(1000, 2000, 5, 20, 64, 5, 100, 900, 40, 64)
ENTRIES = [Entry(HEAD.size, 500, 7, (3, 4, 5)), Entry(HEAD.size + 500, 100, 9, (6,))]


def test_index_and_head_come_back():
    index = packed_index(29.97, ENTRIES)
    head = packed_head(HEAD.size + 600, index)
    offset, length, _ = index_place(head, HEAD.size + 600 + len(index))
    assert (offset, length) == (HEAD.size + 600, len(index))
    assert unpacked_index(index, offset) == (29.97, ENTRIES)


@pytest.mark.parametrize(
    "head, says",
    [
        (b"", "is not a .refmesh file"),
        (b"ply\nformat ascii 1.0\n" + bytes(40), "is not a .refmesh file"),
        (packed_head(0, b"")[:8] + b"\x09" + packed_head(0, b"")[9:], "has version 9"),
        (packed_head(0, b""), "was not written to its end"),
        (packed_head(9999, b"1234"), "is cut off"),
    ],
)
def test_foreign_heads_are_refused(head, says):
    with pytest.raises(RefMeshError, match=says):
        index_place(head, 1000)


@pytest.mark.parametrize(
    "entries, end",
    [
        ([Entry(HEAD.size - 1, 10, 0, (1,))], 1000),
        ([Entry(HEAD.size, 1000, 0, (1,))], 1000),
        ([ENTRIES[0], ENTRIES[0]], 10000),
        ([Entry(HEAD.size, 10, 0, ())], 1000),
        ([Entry(HEAD.size, 10, 0, tuple(range(65)))], 1000),
    ],
)
def test_groups_that_lie_where_none_can_be_are_refused(entries, end):
    with pytest.raises(ValueError, match="where none can be"):
        unpacked_index(packed_index(30.0, entries), end)


@pytest.mark.parametrize("rate", [0.0, -1.0, float("nan"), float("inf")])
def test_impossible_frame_rates_are_refused(rate):
    with pytest.raises(ValueError, match="frames per second"):
        unpacked_index(packed_index(rate, ENTRIES), 1000)


def test_group_head_comes_back():
    head = GroupHead(SHAPE, (1.0, -2.0, 3.0), 1e-4)
    assert group_head(head.packed() + bytes(3000)) == (head, bytes(3000))


def test_counts_beyond_what_a_group_of_that_size_can_hold_are_refused_before_anything_is_decoded():
    with pytest.raises(ValueError, match="2000 triangles, not 1 to"):
        group_head(GroupHead(SHAPE, (0.0, 0.0, 0.0), 1.0).packed())
