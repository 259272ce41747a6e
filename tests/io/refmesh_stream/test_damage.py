"""Damaged streams end in an error or in frames, never in a crash or a hang. `make fuzz` tries 20,000 of them."""

import os
import zlib

import numpy as np
import pytest

from refmesh_addon.core.compression.group_encoder import Balance
from refmesh_addon.core.errors import RefMeshError
from refmesh_addon.io.refmesh_stream.layout import GROUP, HEAD, packed_head, packed_index
from refmesh_addon.io.refmesh_stream.reader import StreamReader
from refmesh_addon.io.refmesh_stream.writer import Quality, write_stream
from tests.io.refmesh_stream.bodies import torus_groups

pytest.importorskip("constriction")
COUNT = int(os.environ.get("REFMESH_DAMAGED_STREAMS", "400"))  # of each kind


@pytest.fixture(scope="module")
def intact(tmp_path_factory):
    path = tmp_path_factory.mktemp("intact") / "torus.refmesh"
    write_stream(path, torus_groups(), 4.0, 25.0, Quality(step=4e-3, balance=Balance(nodes=8)))
    return StreamReader(path)


def outcome(path, data):
    """"frames" or "refused" for a file with these bytes; anything else that is raised fails the test."""
    path.write_bytes(data)
    try:
        reader = StreamReader(path)
        for index in range(len(reader.entries)):
            assert np.isfinite(reader.group(index).positions).all()
    except RefMeshError as error:
        assert str(error).startswith(f"{path}: ")
        return "refused"
    return "frames"


def damaged(data, rng, start=0):
    """Some bytes changed, a run of bytes changed, or the end cut off."""
    result, place = bytearray(data), int(rng.integers(start, len(data)))
    kind = rng.integers(4)
    if kind == 0:
        return bytes(result[:place])
    length = 1 if kind == 1 else int(rng.integers(1, 60))
    result[place : place + length] = rng.integers(0, 256, len(result[place : place + length]), dtype=np.uint8).tobytes()
    return bytes(result)


def test_damage_is_noticed_by_checksums(intact, tmp_path):
    rng, data = np.random.default_rng(1), intact.path.read_bytes()
    outcomes = [outcome(tmp_path / "damaged.refmesh", damaged(data, rng)) for _ in range(COUNT)]
    assert outcomes.count("refused") > 0.9 * COUNT  # the rest changed bytes to what they were, or bytes that mean nothing


@pytest.mark.parametrize("part", ["head of the group", "coded data"])
def test_damage_behind_right_checksums_is_survived(intact, tmp_path, part):
    """What checksums cannot notice: a file that somebody wrote on purpose."""
    rng, entry = np.random.default_rng(2), intact.entries[1]
    group = intact.path.read_bytes()[entry.offset : entry.offset + entry.size]
    for _ in range(COUNT):
        if part == "coded data":
            changed = group[: GROUP.size] + damaged(group[GROUP.size :], rng)
        else:
            changed = damaged(group[: GROUP.size], rng).ljust(GROUP.size, b"\0") + group[GROUP.size :]
        outcome(tmp_path / "damaged.refmesh", as_file(changed, entry))


def as_file(group, entry):
    """A file of one group, with the checksums that belong to it."""
    index = packed_index(25.0, [type(entry)(HEAD.size, len(group), zlib.crc32(group), entry.numbers)])
    return packed_head(HEAD.size + len(group), index) + group + index


def test_an_index_that_is_damaged_behind_a_right_checksum_is_survived(intact, tmp_path):
    rng, data = np.random.default_rng(3), intact.path.read_bytes()
    end = intact.entries[-1].offset + intact.entries[-1].size
    for _ in range(COUNT):
        index = damaged(data[end:], rng)
        outcome(tmp_path / "damaged.refmesh", packed_head(end, index) + data[HEAD.size : end] + index)
