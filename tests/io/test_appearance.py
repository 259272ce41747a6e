"""Colors of frames in every format: the right way up, from the right file, and refused in message."""

import os
import struct

import numpy as np
import pytest
from PIL import Image

from refmesh_addon.io.appearance import files_beside, parse_appearance
from refmesh_addon.io.texture_files import TextureFiles
from refmesh_addon.pipeline.session.written_files import WrittenFiles
from tests.io.colored import COLORS, CORNERS, OBJ, RED, colors_near_corners, encoded, picture, write_obj


def read(path):
    return parse_appearance(path.read_bytes(), path)[:2]


def test_pictures_in_an_output_folder_are_none_of_the_capture(tmp_path):
    path = write_obj(tmp_path)
    (tmp_path / "maps").mkdir()
    (tmp_path / "maps" / "skin.png").write_bytes(b"picture")
    before = files_beside(path)
    assert [name for name, *_ in before if name.endswith(".png")] == ["maps/skin.png", "skin.png"]
    output = tmp_path / "refmesh_take"
    (output / "texture").mkdir(parents=True)
    (output / "texture" / "frame_0001.png").write_bytes(b"result")
    WrittenFiles(output)
    assert files_beside(path) == before


def test_obj_shows_its_picture_the_right_way_up(tmp_path):
    appearance, notes = read(write_obj(tmp_path))
    assert colors_near_corners(appearance) == list(COLORS)
    assert notes == ()


@pytest.mark.parametrize(
    "line",
    [
        "map_Kd -s 1 1 1 -o 0 0 -clamp on my skin.png",
        "map_Kd -bm 0.5 my skin.png",
        'map_Kd "my skin.png"',
        "MAP_KD MY SKIN.PNG",
        r"map_Kd C:\capture\my skin.png",
        "map_Kd -mm 0 1 my skin.png",
    ],
)
def test_picture_is_found_behind_options_spaces_other_case_and_foreign_paths(tmp_path, line):
    path = write_obj(tmp_path, mtl=f"newmtl skin\n{line}\n")
    (tmp_path / "skin.png").rename(tmp_path / "my skin.png")
    appearance, _ = read(path)
    assert colors_near_corners(appearance) == list(COLORS)


def test_each_material_has_its_own_picture(tmp_path):
    path = write_obj(tmp_path, mtl="newmtl skin\nmap_Kd skin.png\nnewmtl cloth\nmap_Kd cloth.png\nnewmtl plain\nKd 0 0 1\n")
    (tmp_path / "cloth.png").write_bytes(encoded(np.full((4, 4, 3), 90, np.uint8)))
    path.write_text(path.read_text().replace("f 1/1 2/2 3/3 4/4", "f 1/1 2/2 3/3\nusemtl cloth\nf 1/1 3/3 4/4\nusemtl plain\nf 1 3 4"))
    appearance, notes = read(path)
    assert appearance.materials.tolist() == [0, 1, -1]
    middle = appearance.at(np.array([1, 2]), np.full((2, 2), 1 / 3, np.float32))
    assert middle.tolist() == [[90, 90, 90], [0, 0, 255]]
    assert notes == ()


def test_wrong_name_gives_way_to_the_number(tmp_path):
    path = write_obj(tmp_path, "scan_0002", mtl="newmtl skin\nmap_Kd gone.png\n")
    (tmp_path / "skin.png").rename(tmp_path / "color_2.png")
    appearance, notes = read(path)
    assert colors_near_corners(appearance) == list(COLORS)
    assert "gone.png" in notes[0] and "color_2.png" in notes[0]


def test_name_of_another_frame_gives_way_to_the_number(tmp_path):
    """600 OBJ that all name the first frame's MTL are common."""
    path = write_obj(tmp_path, "scan_0002", mtl="newmtl skin\nmap_Kd tex_0001.png\n")
    (tmp_path / "skin.png").rename(tmp_path / "tex_0002.png")
    (tmp_path / "tex_0001.png").write_bytes(encoded(np.zeros((4, 4, 3), np.uint8)))
    appearance, notes = read(path)
    assert colors_near_corners(appearance) == list(COLORS)
    assert "another frame" in notes[0]


def test_one_picture_for_all_frames_is_kept(tmp_path):
    path = write_obj(tmp_path, "scan_0002", mtl="newmtl skin\nmap_Kd tex_0001.png\n")
    (tmp_path / "skin.png").rename(tmp_path / "tex_0001.png")
    assert colors_near_corners(read(path)[0]) == list(COLORS)


def test_obj_without_library_takes_the_picture_of_its_name(tmp_path):
    path = write_obj(tmp_path)
    (tmp_path / "skin.png").rename(tmp_path / "scan_0001.PNG")
    path.write_text(path.read_text().replace("mtllib scan.mtl\n", ""))
    assert colors_near_corners(read(path)[0]) == list(COLORS)


@pytest.mark.parametrize("name", ["../secret.png", "link.png", "../input/../secret.png"])
def test_nothing_outside_the_folder_is_opened(tmp_path, name):
    folder = tmp_path / "input"
    folder.mkdir()
    path = write_obj(folder, mtl=f"newmtl skin\nmap_Kd {name}\n")
    (folder / "skin.png").rename(tmp_path / "secret.png")
    (folder / "link.png").symlink_to(tmp_path / "secret.png")
    appearance, notes = read(path)
    assert appearance is None
    assert name in notes[0] and str(path) in notes[0]


def test_library_outside_the_folder_is_refused_and_named(tmp_path):
    folder = tmp_path / "input"
    folder.mkdir()
    path = write_obj(folder, library="../scan.mtl")
    (folder / "scan.mtl").rename(tmp_path / "scan.mtl")
    assert "../scan.mtl" in read(path)[1][0]


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="pipes are POSIX")
def test_only_regular_files_are_opened(tmp_path):
    path = write_obj(tmp_path)
    (tmp_path / "skin.png").unlink()
    os.mkfifo(tmp_path / "skin.png")
    appearance, notes = read(path)
    assert appearance is None
    assert "not a regular file" in notes[0]


@pytest.mark.parametrize("scale", [1.0, 255.0])
def test_obj_vertex_colors(tmp_path, scale):
    path = tmp_path / "scan.obj"
    rows = [f"v {x} {y} 0 {r / 255 * scale} {g / 255 * scale} {b / 255 * scale}" for (x, y), (r, g, b) in zip(CORNERS, COLORS)]
    path.write_text("\n".join([*rows, "f 1 2 3", "f 1 3 4"]))
    appearance, _ = read(path)
    assert appearance.colors[0, 0].tolist() == list(RED)
    assert appearance.size == 0


def test_file_without_color_has_none(tmp_path):
    path = tmp_path / "scan.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    assert read(path) == (None, ())


def test_faces_of_an_obj_that_nothing_colors_are_not_read(tmp_path):
    path = tmp_path / "plain_0001.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 nothing\n")
    assert read(path) == (None, ())


PLY = """ply
format {format} 1.0
{comment}element vertex 4
property float x
property float y
property float z
{vertex}element face {faces}
property list uchar int vertex_indices
{face}end_header
"""
UV_LIST = "property list uchar float texcoord\n"
CHANNELS = "property uchar red\nproperty uchar green\nproperty uchar blue\n"
TEXTURE = "comment TextureFile skin.png\n"
TRIANGLES = ((0, 1, 2), (0, 2, 3))


def ply_header(form, comment="", vertex="", face="", faces=2):
    return PLY.format(format=form, comment=comment, vertex=vertex, face=face, faces=faces)


def test_ply_text_with_coordinates_of_each_corner(tmp_path):
    write_obj(tmp_path)
    path = tmp_path / "scan.ply"
    rows = [f"{x} {y} 0" for x, y in CORNERS]
    uvs = " ".join(f"{x} {y}" for x, y in CORNERS)
    path.write_text(ply_header("ascii", TEXTURE, face=UV_LIST, faces=1) + "\n".join([*rows, f"4 0 1 2 3 8 {uvs}"]) + "\n")
    assert colors_near_corners(read(path)[0]) == list(COLORS)


@pytest.mark.parametrize("order, form", [("<", "binary_little_endian"), (">", "binary_big_endian")])
def test_binary_ply_with_coordinates_of_each_corner(tmp_path, order, form):
    write_obj(tmp_path)
    path = tmp_path / "scan.ply"
    body = b"".join(struct.pack(order + "3f", x, y, 0) for x, y in CORNERS)
    for triangle in TRIANGLES:
        body += struct.pack(order + "B3iB6f", 3, *triangle, 6, *CORNERS[list(triangle)].ravel())
    path.write_bytes(ply_header(form, TEXTURE, face=UV_LIST).encode() + body)
    assert colors_near_corners(read(path)[0]) == list(COLORS)


def test_binary_ply_with_vertex_coordinates_and_polygons_of_two_sizes(tmp_path):
    write_obj(tmp_path)
    path = tmp_path / "scan.ply"
    body = b"".join(struct.pack("<5f", x, y, 0, x, y) for x, y in CORNERS)
    body += struct.pack("<B4i", 4, 0, 1, 2, 3) + struct.pack("<B3i", 3, 0, 1, 2)
    header = ply_header("binary_little_endian", TEXTURE, vertex="property float s\nproperty float t\n")
    path.write_bytes(header.encode() + body)
    appearance, _ = read(path)
    assert len(appearance.mesh.triangles) == 3
    assert colors_near_corners(appearance) == list(COLORS)


def test_ply_vertex_colors(tmp_path):
    path = tmp_path / "scan.ply"
    rows = [f"{x} {y} 0 {r} {g} {b}" for (x, y), (r, g, b) in zip(CORNERS, COLORS)]
    path.write_text(ply_header("ascii", vertex=CHANNELS) + "\n".join([*rows, "3 0 1 2", "3 0 2 3"]) + "\n")
    appearance, _ = read(path)
    assert appearance.colors.tolist() == [[list(COLORS[corner]) for corner in triangle] for triangle in TRIANGLES]


def test_ply_face_colors(tmp_path):
    path = tmp_path / "scan.ply"
    rows = [f"{x} {y} 0" for x, y in CORNERS] + ["3 0 1 2 255 0 0", "3 0 2 3 0 0 255"]
    path.write_text(ply_header("ascii", face=CHANNELS) + "\n".join(rows) + "\n")
    appearance, _ = read(path)
    assert appearance.colors[:, 2].tolist() == [[255, 0, 0], [0, 0, 255]]


def test_glb_with_an_embedded_picture(tmp_path):
    trimesh = pytest.importorskip("trimesh")
    visual = trimesh.visual.TextureVisuals(
        uv=CORNERS.astype(float), material=trimesh.visual.material.PBRMaterial(baseColorTexture=Image.fromarray(picture()))
    )
    mesh = trimesh.Trimesh(np.column_stack([CORNERS, np.zeros(4)]), TRIANGLES, visual=visual, process=False)
    path = tmp_path / "scan.glb"
    mesh.export(path)
    assert colors_near_corners(read(path)[0]) == list(COLORS)


def test_glb_vertex_colors(tmp_path):
    trimesh = pytest.importorskip("trimesh")
    mesh = trimesh.Trimesh(np.column_stack([CORNERS, np.zeros(4)]), TRIANGLES, vertex_colors=np.array(COLORS, np.uint8), process=False)
    path = tmp_path / "scan.glb"
    mesh.export(path)
    assert read(path)[0].colors.tolist() == [[list(COLORS[corner]) for corner in triangle] for triangle in TRIANGLES]


@pytest.mark.parametrize("data", [b"", b"not a picture", encoded(np.zeros((64, 64, 3), np.uint8))[:60]])
def test_picture_that_cannot_be_decoded_is_named(tmp_path, data):
    path = write_obj(tmp_path)
    (tmp_path / "skin.png").write_bytes(data)
    appearance, notes = read(path)
    assert appearance is None
    assert "skin.png" in notes[0] and str(path) in notes[0]


def test_coordinates_beyond_the_picture_repeat_it(tmp_path):
    path = write_obj(tmp_path)
    for x, y in CORNERS:
        path.write_text(path.read_text().replace(f"vt {x} {y}\n", f"vt {x + 2} {y - 3}\n"))
    assert colors_near_corners(read(path)[0]) == list(COLORS)


def test_formats_without_color_have_none(tmp_path):
    path = tmp_path / "scan.stl"
    assert parse_appearance(b"solid", path)[:2] == (None, ())


def test_damaged_ply_is_named(tmp_path):
    path = tmp_path / "scan.ply"
    path.write_text(ply_header("ascii", vertex=CHANNELS) + "0 0 0 1 2\n")
    appearance, notes = read(path)
    assert appearance is None and str(path) in notes[0]


def test_frame_without_a_number_has_no_picture_by_number(tmp_path):
    path = write_obj(tmp_path, "scan")
    assert TextureFiles(path).by_number() is None
    assert OBJ.count("vt") == 4
