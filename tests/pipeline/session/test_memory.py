"""What is left of the memory of this machine, or of the container that it is."""

import pytest

from refmesh_addon.pipeline.session import memory


def test_there_is_memory_and_no_more_than_in_all():
    import os

    assert 2**20 < memory.available_memory() <= os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")


@pytest.mark.parametrize("limit, left", [("1000000", 500_000), ("max", memory._UNKNOWN), ("", memory._UNKNOWN)])
def test_the_limit_of_a_container_counts_and_files_that_it_has_read_do_not(tmp_path, limit, left):
    for name, text in (("memory.max", limit), ("memory.current", "700000"), ("memory.stat", "anon 5\ninactive_file 200000\n")):
        (tmp_path / name).write_text(text + "\n")
    assert memory._container(tmp_path) == left
    assert memory._container(tmp_path / "nothing") == memory._UNKNOWN


def test_larger_meshes_need_more():
    assert 0 < memory.task_bytes(40_000, 40_000) < memory.task_bytes(630_000, 40_000) < memory.task_bytes(630_000, 150_000) < 3e9
    assert memory.task_bytes(630_000, 630_000) > 5e9
