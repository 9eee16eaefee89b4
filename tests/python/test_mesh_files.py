"""Meshes from files and into files."""

from __future__ import annotations

import sys
import warnings
from pathlib import Path

import numpy as np
import pytest
import sheetbend as sb
from pytest import approx
from sheetbend.optional import MissingExtraError

CUT = """# a square whose two halves are cut apart in the texture
v 0 0 0
v 100 0 0
v 100 100 0
v 0 100 0
vt 0 0
vt 0.1 0
vt 0.1 0.1
vt 0.5 0
vt 0.6 0.1
vt 0.5 0.1
f 1/1 2/2 3/3
f 1/4 3/5 4/6
"""


def bumpy() -> sb.TriangleMesh:
    flat = sb.mesh.grid(0.4, 0.3, 4, 3)
    x, y, _ = flat.vertices.T
    return sb.TriangleMesh(np.column_stack([x, y, 0.05 * np.sin(9 * x) * y]), flat.triangles, flat.material)


@pytest.mark.parametrize("suffix", [".obj", ".ply"])
def test_what_is_written_is_read_again(tmp_path: Path, suffix: str) -> None:
    mesh = bumpy()
    {".obj": sb.mesh.write_obj, ".ply": sb.mesh.write_ply}[suffix](tmp_path / f"mesh{suffix}", mesh)
    again = sb.read_mesh(tmp_path / f"mesh{suffix}")
    assert np.array_equal(again.triangles, mesh.triangles)
    assert again.vertices == approx(mesh.vertices, abs=1e-10) and again.material == approx(mesh.material, abs=1e-10)


def test_material_per_corner_survives_an_obj(tmp_path: Path) -> None:
    mesh = sb.mesh.icosphere(0.1, 1)
    sb.mesh.write_obj(tmp_path / "ball.obj", mesh)
    with pytest.warns(UserWarning, match="the warp direction jumps"):
        again = sb.read_mesh(tmp_path / "ball.obj")
    assert np.array_equal(again.triangles, mesh.triangles) and again.material == approx(mesh.material, abs=1e-10)


def test_a_cut_in_the_texture_is_no_cut_in_the_mesh(tmp_path: Path) -> None:
    (tmp_path / "cut.obj").write_text(CUT)
    mesh = sb.read_mesh(tmp_path / "cut.obj", unit="mm")
    assert mesh.vertices.tolist() == [[0, 0, 0], [0.1, 0, 0], [0.1, 0.1, 0], [0, 0.1, 0]]  # in the file's order
    assert len(mesh.hinges) == 1
    assert mesh.material[1] == approx(np.array([[0.5, 0.0], [0.6, 0.1], [0.5, 0.1]]))


def test_a_ply_with_texture_coordinates_per_face(tmp_path: Path) -> None:
    header = ["ply", "format ascii 1.0", "element vertex 4", *(f"property float {c}" for c in "xyz"), "element face 2"]
    header += ["property list uchar int vertex_indices", "property list uchar float texcoord", "end_header"]
    rows = ["0 0 0", "1 0 0", "1 1 0", "0 1 0", "3 0 1 2 6 0 0 1 0 1 1", "3 0 2 3 6 5 0 6 1 5 1"]
    (tmp_path / "cut.ply").write_text("\n".join([*header, *rows, ""]))
    mesh = sb.read_mesh(tmp_path / "cut.ply")
    assert mesh.triangles.tolist() == [[0, 1, 2], [0, 2, 3]] and mesh.vertices[2].tolist() == [1, 1, 0]
    assert mesh.material.tolist() == [[[0, 0], [1, 0], [1, 1]], [[5, 0], [6, 1], [5, 1]]]


def test_an_stl_is_merged_and_unrolled(tmp_path: Path) -> None:
    mesh = sb.mesh.grid(0.4, 0.3, 4, 3)
    facets = []
    for corners in mesh.vertices[mesh.triangles]:
        lines = "".join(f"vertex {x:.7g} {y:.7g} {z:.7g}\n" for x, y, z in corners)
        facets.append(f"facet normal 0 0 1\nouter loop\n{lines}endloop\nendfacet\n")
    (tmp_path / "sheet.stl").write_text("solid sheet\n" + "".join(facets) + "endsolid sheet\n")
    again = sb.read_mesh(tmp_path / "sheet.stl")
    assert len(again.vertices) == len(mesh.vertices) and len(again.hinges) == len(mesh.hinges)
    assert again.material == approx(again.vertices[:, :2], abs=1e-9)
    assert again.vertices[0].tolist() == mesh.vertices[mesh.triangles[0, 0]].tolist()  # in the order of first use


@pytest.mark.filterwarnings("error")
def test_vertices_that_an_exporter_split_are_merged_on_request(tmp_path: Path) -> None:
    """Quads of their own vertices, with normals and without texture coordinates, in centimeters."""
    cells = [(i, j) for j in range(3) for i in range(3)]
    vertices = [f"v {10 * (i + a)} {10 * (j + b)} 0" for i, j in cells for a, b in ((0, 0), (1, 0), (1, 1), (0, 1))]
    quads = ["f " + " ".join(f"{4 * k + n}//1" for n in (1, 2, 3, 4)) for k in range(9)]
    (tmp_path / "split.obj").write_text("\n".join([*vertices, "vn 0 0 1", *quads]))
    with pytest.raises(UserWarning, match="9 parts"):
        sb.read_mesh(tmp_path / "split.obj", unit="cm")
    mesh = sb.read_mesh(tmp_path / "split.obj", unit="cm", merge=True)
    assert len(mesh.vertices) == 16 and len(mesh.triangles) == 18 and mesh.doubts == ()
    assert mesh.areas.sum() == approx(0.09)


@pytest.mark.filterwarnings("ignore:.*gathered seams")
def test_a_texture_that_is_no_flat_pattern_is_named(tmp_path: Path) -> None:
    """One half of the square is 1.4 times as wide in the texture, as unwrapping without seams leaves it."""
    stretched = CUT.replace("vt 0.5 0\nvt 0.6 0.1\nvt 0.5 0.1", "vt 0.5 0\nvt 0.64 0.1\nvt 0.5 0.1")
    (tmp_path / "bad.obj").write_text(stretched)
    with pytest.warns(UserWarning, match=r"1 of 2 triangles have sides up to 1\.4 times") as said:
        sb.read_mesh(tmp_path / "bad.obj", unit="mm")
    assert any("material='unfold'" in str(w.message) for w in said)


def test_triangles_of_two_corners_are_left_out(tmp_path: Path) -> None:
    """As decimation leaves them; also those that merging makes, of a sliver between two copies of a vertex."""
    (tmp_path / "cut.obj").write_text(CUT + "f 1/1 2/2 2/2\nf 3/3 1/1 3/3\n")
    with pytest.warns(UserWarning, match="2 triangles that name a vertex twice are left out"):
        mesh = sb.read_mesh(tmp_path / "cut.obj", unit="mm")
    assert mesh.triangles.tolist() == [[0, 1, 2], [0, 2, 3]] and mesh.material.shape == (2, 3, 2)
    split = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 1 1 0\nv 0 1 0\nf 1 2 3\nf 1 3 4\nf 1 4 5\n"
    (tmp_path / "split.obj").write_text(split)
    with pytest.warns(UserWarning, match="1 triangles that name"):
        assert sb.read_mesh(tmp_path / "split.obj", merge=True).triangles.tolist() == [[0, 1, 2], [0, 2, 3]]


@pytest.mark.parametrize(("unit", "size"), [("m", "600 m large, read in m"), ("mm", None), ("cm", None)])
def test_a_size_that_no_fabric_has_is_named(tmp_path: Path, unit: str, size: str | None) -> None:
    (tmp_path / "shirt.obj").write_text("v 0 0 0\nv 500 0 0\nv 500 600 0\nv 0 600 0\nf 1 2 3 4\n")
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        sb.read_mesh(tmp_path / "shirt.obj", unit=unit)
    assert [str(w.message) for w in said if size and size in str(w.message)] or (not size and not said)


def test_the_caller_chooses_the_material(tmp_path: Path) -> None:
    (tmp_path / "cut.obj").write_text(CUT)
    unfolded = sb.read_mesh(tmp_path / "cut.obj", "unfold", unit="cm", warp=(0, 1, 0))
    assert unfolded.material == approx(np.array([[0, 0], [0, -1], [1, -1], [1, 0]]), abs=1e-12)
    given = sb.read_mesh(tmp_path / "cut.obj", [[0, 0], [2, 0], [2, 2], [0, 2]], unit="cm")
    assert given.areas == approx(np.array([2.0, 2.0]))
    sized = sb.read_mesh(tmp_path / "cut.obj", unit="cm", texture_size=[10.0, 9.0])
    assert sized.areas == approx(np.array([0.45, 0.45]))


def test_texture_coordinates_of_another_size_are_refused_with_the_size_that_fits(tmp_path: Path) -> None:
    (tmp_path / "cut.obj").write_text(CUT)
    with pytest.raises(
        sb.MeshError, match=r"makes 0.01 m\^2 of fabric from a shape of 1 m\^2.*10 makes the areas equal"
    ):
        sb.read_mesh(tmp_path / "cut.obj", unit="cm")


@pytest.mark.parametrize(
    ("name", "content", "options", "message"),
    [
        ("mesh.off", "", {}, "path: has a suffix that no reader knows .*use one of .obj, .ply, .stl"),
        ("mesh.obj", None, {}, "mesh.obj: is not a file"),
        ("mesh.obj", "v 0 0 0\nv 1 0 0\n", {}, "has no triangles"),
        ("mesh.ply", "not a mesh", {}, "cannot be read"),
        ("mesh.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n", {}, "cannot be read|vertices that do not exist"),
        ("mesh.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", {"material": "texture"}, "has no texture coordinates"),
        ("mesh.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", {"material": "uv"}, "material: is unknown"),
        ("mesh.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", {"unit": "inch"}, "unit: is unknown .*m, cm, mm"),
        ("mesh.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nf 1 2 3\n", {}, "belong to no triangle"),
    ],
)
def test_bad_files_are_refused(
    tmp_path: Path, name: str, content: str | None, options: dict[str, str], message: str
) -> None:
    if content is not None:
        (tmp_path / name).write_text(content)
    with pytest.raises(sb.MeshError, match=message):
        sb.read_mesh(tmp_path / name, **options)


def test_without_trimesh_the_error_names_the_extra(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "cut.obj").write_text(CUT)
    monkeypatch.setitem(sys.modules, "trimesh", None)
    with pytest.raises(MissingExtraError, match=r"pip install 'sheetbend\[mesh\]'"):
        sb.read_mesh(tmp_path / "cut.obj")


def test_a_sequence_has_one_file_per_frame(tmp_path: Path) -> None:
    mesh = bumpy()
    frames = mesh.vertices + np.linspace(0, 1, 3)[:, None, None] * [0.0, 0.0, 0.2]
    files = sb.mesh.write_obj_sequence(tmp_path / "drop", mesh, frames)
    assert [f.name for f in files] == ["frame_00000.obj", "frame_00001.obj", "frame_00002.obj"]
    assert sb.read_mesh(files[2]).vertices == approx(frames[2], abs=1e-10)
    sb.mesh.write_obj_sequence(tmp_path / "drop", mesh, frames)  # once more over itself
    with pytest.raises(sb.MeshError, match="folder: holds frames of another sequence"):
        sb.mesh.write_obj_sequence(tmp_path / "drop", mesh, frames[:2])
    with pytest.raises(sb.MeshError, match="positions: has the wrong shape"):
        sb.mesh.write_obj_sequence(tmp_path / "other", mesh, frames[0])


def test_a_ply_carries_fields(tmp_path: Path) -> None:
    trimesh = pytest.importorskip("trimesh")
    mesh = bumpy()
    strain, height = np.linspace(-1, 1, len(mesh.triangles)), mesh.vertices[:, 2] / 3
    lifted = mesh.vertices + np.array([0, 0, 1])
    sb.mesh.write_ply(
        tmp_path / "a.ply", mesh, lifted, vertex_fields={"height": height}, face_fields={"strain": strain}
    )
    raw = trimesh.load_mesh(str(tmp_path / "a.ply"), process=False).metadata["_ply_raw"]
    assert np.array_equal(raw["vertex"]["data"]["z"].ravel(), lifted[:, 2])  # every bit
    assert np.array_equal(raw["vertex"]["data"]["height"].ravel(), height)
    assert np.array_equal(raw["face"]["data"]["strain"].ravel(), strain)
    for fields, message in (
        ({"face_fields": {"strain": strain[1:]}}, r"face_fields\['strain'\]: has the wrong shape"),
        ({"vertex_fields": {"x": height}}, "has a name that cannot stand in the file"),
        ({"face_fields": {"a b": strain}}, "has a name that cannot stand in the file"),
    ):
        with pytest.raises(sb.MeshError, match=message):
            sb.mesh.write_ply(tmp_path / "b.ply", mesh, **fields)


def obj(path: Path, vertices: list[tuple[float, ...]], faces: list[tuple[int, ...]]) -> Path:
    lines = [f"v {x} {y} {z}" for x, y, z in vertices]
    path.write_text("\n".join([*lines, *("f " + " ".join(str(k + 1) for k in face) for face in faces)]) + "\n")
    return path


STRIP = [(float(x), float(y), 0.0) for x in range(4) for y in range(2)]
FACES = [(0, 2, 1), (1, 2, 3), (2, 4, 3), (3, 4, 5), (4, 6, 5), (5, 6, 7)]


def test_triangles_that_face_against_the_others_are_reversed(tmp_path: Path) -> None:
    """They were refused, and so were vertices that no face uses."""
    turned = [face[::-1] if k in (1, 4) else face for k, face in enumerate(FACES)]
    path = obj(tmp_path / "strip.obj", [(9.0, 9.0, 9.0), *STRIP], [tuple(k + 1 for k in face) for face in turned])
    with pytest.raises(sb.MeshError, match=r"oriented against each other .*read it with `merge`"):
        sb.read_mesh(path)
    with pytest.warns(UserWarning, match="2 triangles that face against the others are reversed") as said:
        mesh = sb.read_mesh(path, merge=True)
    assert sorted(map(sorted, mesh.triangles.tolist())) == sorted(map(sorted, FACES)) and len(mesh.vertices) == 8
    assert "vertices without a triangle are left out: 1" in " ".join(str(w.message) for w in said)


def test_a_surface_of_one_side_stays_refused(tmp_path: Path) -> None:
    n = 12
    angle = 2 * np.pi * np.arange(n) / n
    rim = [
        ((1 + s * np.cos(a / 2)) * np.cos(a), (1 + s * np.cos(a / 2)) * np.sin(a), s * np.sin(a / 2))
        for a in angle
        for s in (-0.3, 0.3)
    ]
    faces = []
    for i in range(n):
        a, b = 2 * i, 2 * i + 1
        c, d = (2 * i + 2, 2 * i + 3) if i + 1 < n else (1, 0)
        faces += [(a, c, b), (b, c, d)]
    with pytest.raises(sb.MeshError, match="oriented against each other"):
        sb.read_mesh(obj(tmp_path / "moebius.obj", rim, faces), merge=True)
