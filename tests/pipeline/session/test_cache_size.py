"""The cache of an output folder: told how large, cleaned, and filled again to the same results."""

from refmesh_addon.pipeline.session.cache_size import cache_size, clean_cache

from ..running import cache_entries, finish, results


def test_a_cleaned_folder_keeps_its_results_and_is_computed_again(output, two_balls, finished):
    kept = {path: path.read_bytes() for path in output.rglob("*") if path.is_file() and path.suffix != ".npz"}
    previews = sorted((output / "cache" / "preview").iterdir())
    (output / "cache" / "notes.npz").write_bytes(b"mine")
    size, entries = cache_size(output), cache_entries(finished)
    assert size > 1000 * len(entries)
    assert clean_cache(output) == size
    assert (cache_size(output), list(cache_entries(output))) == (0, ["notes.npz"])
    assert sorted((output / "cache" / "preview").iterdir()) == previews
    assert {path: path.read_bytes() for path in kept} == kept and results(output) == results(finished)
    assert clean_cache(output) == 0
    finish(two_balls, output)
    assert results(output) == results(finished)
    assert set(cache_entries(output)) == {*entries, "notes.npz"}


def test_a_folder_without_a_cache_has_nothing_to_clean(tmp_path):
    assert cache_size(tmp_path) == clean_cache(tmp_path) == 0
