"""Meshes of solids: geometry, places, files, refusals, and how much tetrahedra lock."""

import numpy as np
import pytest
import sheetbend as sb
from pytest import approx
from sheetbend.objects.locking import locking

BOX = (0.1, 0.03, 0.02)


def skewed(mesh: sb.SolidMesh, by: float = 0.002) -> sb.SolidMesh:
    """The same with its inner vertices moved at random."""
    inner = np.setdiff1d(np.arange(len(mesh.vertices)), np.concatenate(list(mesh.sets.values())))
    moved = mesh.vertices.copy()
    moved[inner] += np.random.default_rng(3).uniform(-by, by, (len(inner), 3))
    return sb.SolidMesh(moved, mesh.elements, dict(mesh.sets))


@pytest.mark.parametrize("make", [sb.mesh.bricks, sb.mesh.tetrahedra])
def test_a_box_has_its_volume_surface_and_sets(make):
    mesh = skewed(make(BOX, (5, 3, 2), at=(1.0, 2.0, 3.0)))
    a, b, c = BOX
    assert mesh.volumes.sum() == approx(a * b * c, rel=1e-13)
    assert mesh.points[2].sum() == approx(a * b * c, rel=1e-13)
    surface, used = mesh.surface
    assert surface.areas.sum() == approx(2 * (a * b + b * c + c * a), rel=1e-13)
    corners = mesh.vertices[used][surface.triangles]
    assert np.linalg.det(corners).sum() / 6 == approx(a * b * c, rel=1e-9)  # counterclockwise from outside
    for axis, name in enumerate("xyz"):
        face = mesh.vertices[mesh.sets[f"{name}_max"], axis]
        assert face == approx(np.full(len(face), 1.0 + axis + BOX[axis]))


@pytest.mark.parametrize("make", [sb.mesh.bricks, sb.mesh.tetrahedra])
def test_gradients_are_exact_for_linear_fields(make):
    mesh = skewed(make(BOX, (3, 2, 2)))
    slope = np.array([0.3, -0.7, 1.1])
    field = mesh.vertices @ slope
    found = np.einsum("mqnx,mn->mqx", mesh.points[0], field[mesh.elements])
    assert found == approx(np.broadcast_to(slope, found.shape), abs=1e-11)


@pytest.mark.parametrize("make", [sb.mesh.bricks, sb.mesh.tetrahedra])
def test_places_are_where_the_points_are(make):
    mesh = skewed(make(BOX, (4, 3, 2)))
    points = np.random.default_rng(0).uniform((0, 0, 0), BOX, (30, 3))
    points[0] = BOX  # a corner
    points[1, 0] = 0.0  # on a face
    places = mesh.at(points)
    assert places.positions(mesh.vertices) == approx(points, abs=1e-9)
    assert (places.weights >= 0).all()
    assert (places.weights[0] > 0).sum() == 1
    assert (places.weights[1] > 0).sum() <= 4
    with pytest.raises(sb.MeshError, match="outside"):
        mesh.at([[0.05, 0.01, 0.021]])


def test_refusals():
    box = sb.mesh.bricks(BOX, (1, 1, 1))
    with pytest.raises(sb.MeshError, match="inside out"):
        sb.SolidMesh(box.vertices, box.elements[:, [4, 5, 6, 7, 0, 1, 2, 3]])
    with pytest.raises(sb.MeshError, match="twice"):
        sb.SolidMesh(box.vertices, box.elements[:, [0, 1, 2, 3, 4, 5, 6, 6]])
    with pytest.raises(sb.MeshError, match="no element"):
        sb.SolidMesh(np.vstack([box.vertices, [[9.0, 9.0, 9.0]]]), box.elements)
    with pytest.raises(sb.MeshError, match="shape"):
        sb.SolidMesh(box.vertices, box.elements[:, :6])
    with pytest.raises(sb.MeshError, match="cells"):
        sb.mesh.bricks(BOX, (1, 0, 1))


@pytest.mark.parametrize(("make", "suffix"), [(sb.mesh.bricks, ".msh"), (sb.mesh.tetrahedra, ".vtk")])
def test_meshes_from_files(tmp_path, make, suffix):
    meshio = pytest.importorskip("meshio")
    mesh = make(BOX, (3, 2, 1))
    kind = "hexahedron" if mesh.elements.shape[1] == 8 else "tetra"
    points = np.vstack([[[5.0, 5.0, 5.0]], 1e3 * mesh.vertices])  # one that no element uses, in mm
    path = tmp_path / f"box{suffix}"
    cells = [("triangle", mesh.surface[1][mesh.surface[0].triangles] + 1), (kind, mesh.elements + 1)]
    named = {"skin": np.array([1, 2]), "body": np.array([2, 3])}
    tags = [np.full(len(data), tag) for (_, data), tag in zip(cells, (1, 2), strict=True)]
    content = meshio.Mesh(points, cells, field_data=named, cell_data={"gmsh:physical": tags, "gmsh:geometrical": tags})
    meshio.write(path, content, file_format="gmsh22" if suffix == ".msh" else "vtk")
    found = sb.mesh.read_solid(path, unit="mm")
    assert found.vertices == approx(mesh.vertices, abs=1e-15)
    assert (found.elements == mesh.elements).all()
    if suffix == ".msh":  # groups with names
        assert set(found.sets["skin"]) == set(mesh.surface[1])


@pytest.mark.parametrize("fmt", ["gmsh22", "gmsh"])
def test_values_that_meshio_writes_as_numpy_shows_them(tmp_path, fmt):
    """Text files with data of nodes or elements hold "np.float64(1.0)", which meshio refused as unmatched data."""
    meshio = pytest.importorskip("meshio")
    box, path = sb.mesh.tetrahedra(BOX, (2, 1, 1)), tmp_path / "box.msh"
    values = {"heat": np.linspace(-1.5e-7, 1.0, len(box.vertices))}
    content = meshio.Mesh(box.vertices, [("tetra", box.elements)], values, {"strain": [np.ones(len(box.elements))]})
    meshio.write(path, content, file_format=fmt, binary=False)
    found = sb.mesh.read_solid(path)
    assert found.vertices == approx(box.vertices) and (found.elements == box.elements).all()


def test_files_that_are_no_solid(tmp_path):
    meshio = pytest.importorskip("meshio")
    box = sb.mesh.bricks(BOX, (1, 1, 1))
    surface = tmp_path / "surface.vtk"
    meshio.write(surface, meshio.Mesh(box.vertices, [("quad", box.elements[:, :4])]))
    with pytest.raises(sb.MeshError, match="exactly one kind"):
        sb.mesh.read_solid(surface)
    broken = tmp_path / "broken.msh"
    broken.write_text("$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Nodes\n1 2")
    with pytest.raises(sb.MeshError, match="holds less than its counts say"):
        sb.mesh.read_solid(broken)
    with pytest.raises(sb.MeshError, match="not a file"):
        sb.mesh.read_solid(tmp_path / "missing.msh")
    with pytest.raises(sb.MeshError, match="suffix"):
        sb.mesh.read_solid(tmp_path / "box.step")


LARGEST = b"\xff\xff\xff\x7f"


def longs(*numbers: int) -> bytes:
    return np.array(numbers, dtype="<u8").tobytes()


def ints(*numbers: int) -> bytes:
    return np.array(numbers, dtype="<i4").tobytes()


TABLE, LESS, SUM = (
    "nodes: have numbers whose table takes",
    "holds less than its counts say",
    "as many nodes or elements",
)
NUMBERS = {
    "2.2 binary": (b"$Nodes\n8\n", b"$Nodes\n4294967296\n", LESS),
    "2.2": (b"\n8 ", b"\n2147483647 ", TABLE),
    "4.0 binary": (ints(8) + sb.mesh.bricks((0.2, 0.1, 0.1), (1, 1, 1)).vertices[7].tobytes(), LARGEST, TABLE),
    "4.1 binary": (longs(7, 8), longs(7 + 2**32), TABLE),
    "4.1": (b"\n8\n", b"\n4294967296\n", TABLE),
    "4.1 odd binary": (b"\n4.1 1 8\n", b"\n4.\x7f 1 8\n", None),  # meshio takes it for 4.1
    "4.1 nodes binary": (longs(1, 8, 1, 8), longs(1, 41996, 1, 8), SUM),
    "4.1 nodes": (b"\n1 8 1 8\n", b"\n1 41996 1 8\n", SUM),
    "4.0 nodes": (b"$Nodes\n1 8\n", b"$Nodes\n1 16711692\n", SUM),
    "4.1 blocks binary": (b"$Elements\n" + longs(1), b"$Elements\n" + longs(2**40), LESS),
    "4.1 block binary": (ints(5) + longs(1), ints(5) + longs(2**33), LESS),
    "4.1 block": (b" 5 1\n", b" 5 8589934592\n", LESS),
    "2.2 elements binary": (ints(5, 1, 2), ints(5, 2**31 - 1, -9), "negative count of tags"),
    "2.2 kind binary": (ints(5, 1, 2), ints(500, 1, 2), "of a kind that is not read"),
    "4.1 curved binary": (ints(3, 0, 0) + longs(8), ints(3, 0, 1) + longs(8), "Mesh.SaveParametric"),
    "4.1 size binary": (b"\n4.1 1 8\n", b"\n4.1 1 1\n", "does not begin as Gmsh files do"),
    "2.2 values binary": (b"\n0\n1\n8\n", b"\n0\n1\n9999999999\n", LESS),
    "2.2 name binary": (b"$EndMeshFormat\n", b"$EndMeshFormat\n$" + 2**15 * b"a ", "where a section begins"),
    "4.1 words binary": (b"$NodeData\n1\n", b"$NodeData\nx\n", "has no count where one belongs"),
}


@pytest.mark.parametrize("case", NUMBERS)
def test_numbers_of_a_gmsh_file_ask_for_no_memory(tmp_path, case):
    """Some 2 kB that named node 4,294,967,296 took 32 GB."""
    meshio = pytest.importorskip("meshio")
    (old, new, words), version, binary = NUMBERS[case], case.split()[0], case.endswith("binary")
    box, path = sb.mesh.bricks((0.2, 0.1, 0.1), (1, 1, 1)), tmp_path / "box.msh"
    values = {"heat": np.zeros(8)} if b"Data" in old or b"\n1\n8" in old else {}
    mesh = meshio.Mesh(box.vertices, [("hexahedron", box.elements)], values)
    meshio.gmsh.write(path, mesh, fmt_version=version, binary=binary)
    content = path.read_bytes()
    assert old in content and len(sb.mesh.read_solid(path).vertices) == 8
    changed = content.replace(old, new + old[len(new) :] if binary and b"\n" not in old else new, 1)
    if words is None:
        path.write_bytes(changed)
        assert len(sb.mesh.read_solid(path).vertices) == 8
        changed, words = changed.replace(longs(7, 8), longs(7, 8 + 2**32)), TABLE
    for end in (b"\n",) if binary else (b"\n", b"\r\n"):
        path.write_bytes(changed.replace(b"\n", end))
        with pytest.raises(sb.MeshError, match=words):
            sb.mesh.read_solid(path)


def test_tetrahedra_are_told_by_how_much_they_lock():
    """A silicone beam of 10 x 3 x 3 cells: 6 times too stiff, hardly so where the material is compressible."""
    mesh = sb.mesh.tetrahedra((0.1, 0.03, 0.03), (10, 3, 3))
    held = np.isin(np.arange(len(mesh.vertices)), mesh.sets["x_min"])
    assert locking(mesh, 0.499, held) == approx(6.08, rel=0.01)
    assert locking(mesh, 0.3, held) == approx(1.32, rel=0.01)
    with pytest.warns(sb.LockingWarning, match="6.1 times too stiff"):
        sb.solid(mesh, density=1070.0, E=2.64e5, poisson=0.499, pinned=mesh.sets["x_min"])


def test_bricks_carry_a_surface():
    """A ball: its volume by the shares, places for all vertices, and its law's energy in that volume."""
    ball = sb.mesh.icosphere(0.05, 3)
    mesh = sb.mesh.bricks_around(ball, 0.0125)
    corners = ball.vertices[ball.triangles]
    inside = np.linalg.det(corners).sum() / 6
    assert mesh.volumes.sum() == approx(inside, rel=0.02)
    assert mesh.fill.min() > 0 and mesh.fill.max() == 1.0
    solid = sb.solid(mesh, density=1000.0, E=1e5, poisson=0.3).solids["solid"]
    places = sb.on_solid(solid, ball.vertices)
    found = np.array([np.asarray(p.weights) @ mesh.vertices[list(p.particles)] for p in places])
    assert found == approx(ball.vertices, abs=1e-9)
    scene = sb.solid(mesh, density=1000.0, E=1e5, poisson=0.3)
    stored = sum(float(e.sum()) for e in sb.elastic_energy(scene, mesh.vertices * [1.1, 1.0, 1.0]).values())
    strain, mu, lam = (1.1**2 - 1) / 2, 1e5 / 2.6, 1e5 * 0.3 / (1.3 * 0.4)
    assert stored == approx((mu * strain**2 + lam * 0.1**2 / 2) * mesh.volumes.sum(), rel=1e-9)
    box = sb.mesh.bricks(BOX, (3, 2, 1)).surface[0]
    around = sb.mesh.bricks_around(box, 0.01)
    assert len(around.elements) == 60 and (around.fill == 1.0).all()
    with pytest.raises(sb.MeshError, match="inside out"):
        sb.mesh.bricks_around(
            sb.TriangleMesh(box.vertices, box.triangles[:, ::-1], box.corners[:, [0, 2, 1]] * [1, -1]), 0.01
        )
    opened = sb.mesh.grid(0.1, 0.1, 2, 2)
    with pytest.raises(sb.MeshError, match="not closed"):
        sb.mesh.bricks_around(opened, 0.01)
