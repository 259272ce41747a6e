"""The takes of a batch, read from a table or a folder."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "headless"))
from takes import BatchError, Columns, read_takes  # noqa: E402

COLUMNS = Columns(frozenset({"resume"}), frozenset({"frames", "preset", "export", "mesh"}), lambda path: path.endswith(".abc"))


def read(path: Path, out="out"):
    return read_takes(path, Path(out), COLUMNS)


def table(folder: Path, text: str) -> Path:
    path = folder / "takes.csv"
    path.write_text(text, encoding="utf-8")
    return path


def test_each_folder_and_scene_file_in_a_folder_is_a_take(tmp_path):
    for name in ("jump", "dance", ".trash"):
        (tmp_path / name).mkdir()
    for name in ("notes.txt", "cloth.abc"):
        (tmp_path / name).touch()
    takes = read(tmp_path)
    assert [take.source for take in takes] == [str(tmp_path / name) for name in ("cloth.abc", "dance", "jump")]
    assert [take.output for take in takes] == [Path("out/cloth"), Path("out/dance"), Path("out/jump")]


def test_options_of_a_row_are_words_of_the_command_line(tmp_path):
    (tmp_path / "jump").mkdir()
    rows = "input,output,frames,Preset,--resume,export,mesh\njump,,6-10,draft,no,usd  glb,own/mesh.obj\n\n'a'/x_*.obj,second,,,yes,,\n"
    first, second = read(table(tmp_path, rows))
    options = ["--frames=6-10", "--preset=draft", "--no-resume", "--export=usd", "--export=glb", f"--mesh={tmp_path / 'own/mesh.obj'}"]
    assert (first.name, list(first.options)) == ("jump", options)
    assert (second.source, second.name, second.options) == (str(tmp_path / "'a'/x_*.obj"), "second", ("--resume",))


@pytest.mark.parametrize("text", ["input;frames\njump;1,3\n", "input\tframes\njump\t1,3\n", '\ufeffinput,frames\njump,"1,3"\n'])
def test_the_tables_that_programs_write_are_read(tmp_path, text):
    (take,) = read(table(tmp_path, text))
    assert take.options == ("--frames=1,3",)


@pytest.mark.parametrize(
    "source, name",
    [("jump", "jump"), ("jump/", "jump"), ("jump/scan_01.obj", "jump"), ("jump/#/mesh_*.obj", "jump"), ("a/cloth.abc", "cloth")],
)
def test_a_take_has_the_name_of_its_folder(tmp_path, source, name):
    (tmp_path / "jump").mkdir()
    assert read(table(tmp_path, f"input\n{source}\n"))[0].name == name


@pytest.mark.parametrize(
    "text, message",
    [
        ("", "no column 'input'"),
        ("input\n", "holds no takes"),
        ("folder\njump\n", "no column 'input'"),
        ("input,speed\njump,3\n", "the column 'speed' is not an option"),
        ("input,frames,--frames\njump,1,2\n", "the column 'frames' appears twice"),
        ("input,resume\njump,perhaps\n", "line 2: 'resume' is 'perhaps'; write yes or no"),
        ("input,frames\n,3\n", "line 2: 'input' is empty"),
        ("input,frames\njump,1,3\n", "line 2: more cells than columns"),
        ("input\na/jump/x.obj\nb/jump/x.obj\n", "would share"),
    ],
)
def test_a_table_that_cannot_be_meant_is_refused(tmp_path, text, message):
    with pytest.raises(BatchError, match=message):
        read(table(tmp_path, text))


def test_a_missing_or_binary_file_is_refused(tmp_path):
    (tmp_path / "takes.csv").write_bytes(b"\xff\xfe\x00")
    (tmp_path / "long.csv").write_text("input\n" + "x" * 200_000)
    for name, message in (("takes.csv", "cannot be read as CSV"), ("nothing.csv", "no such file"), ("long.csv", "cannot be read as CSV")):
        with pytest.raises(BatchError, match=message):
            read(tmp_path / name)
