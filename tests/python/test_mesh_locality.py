"""Renumbered meshes are the same cloth, and large ones whose numbers jump say so."""

import numpy as np
import pytest
import sheetbend as sb


def shuffled(cells: int, per_corner: bool = False) -> sb.TriangleMesh:
    mesh, rng = sb.mesh.grid(2.0, 1.0, 2 * cells, cells, "one_way"), np.random.default_rng(0)
    order, rows = rng.permutation(len(mesh.vertices)), rng.permutation(len(mesh.triangles))
    place = np.argsort(order)
    material = mesh.corners[rows] if per_corner else mesh.material[order]
    sets = {name: place[ids] for name, ids in mesh.sets.items()}
    return sb.TriangleMesh(mesh.vertices[order], place[mesh.triangles][rows], material, sets)


def apart(mesh: sb.TriangleMesh) -> float:
    return float(np.abs(np.diff(mesh.edges, axis=1)).mean())


@pytest.mark.parametrize("per_corner", [False, True])
def test_it_is_the_same_mesh_with_neighbors_near_each_other(per_corner: bool) -> None:
    before = shuffled(12, per_corner)
    after = sb.mesh.renumbered(before)
    assert apart(after) < 0.1 * apart(before)
    for mesh in (before, after):
        assert mesh.areas.sum() == pytest.approx(2.0)
    for name, ids in before.sets.items():
        seen, expected = after.vertices[after.sets[name]], before.vertices[ids]
        np.testing.assert_array_equal(np.unique(seen, axis=0), np.unique(expected, axis=0))

    def signature(mesh: sb.TriangleMesh) -> np.ndarray:
        """Each triangle's vertices in space beside its material coordinates, from its first corner in space on."""
        both = np.concatenate([mesh.vertices[mesh.triangles], mesh.corners], axis=2)
        first = [np.lexsort(rows.T[::-1])[0] for rows in both]
        turned = [np.roll(rows, -k, axis=0) for rows, k in zip(both, first, strict=True)]
        return np.unique(np.reshape(turned, (len(both), -1)), axis=0)

    np.testing.assert_array_equal(signature(after), signature(before))


def test_a_cloth_hangs_the_same() -> None:
    ends = []
    for mesh in (shuffled(5), sb.mesh.renumbered(shuffled(5))):
        scene = sb.Scene("cloth")
        cloth = sb.add_cloth(scene, mesh, density=0.2, warp=40.0, shear=15.0, poisson=0.1, bending=1e-3)
        left = np.flatnonzero(mesh.material[:, 0] == 0.0)
        scene.pin(cloth.particles[left])
        rest = sb.equilibrium(scene).positions[cloth.particles]
        ends.append(rest[np.lexsort(mesh.material.T)])
    np.testing.assert_allclose(ends[1], ends[0], atol=1e-9)


def test_large_meshes_whose_numbers_jump_say_what_to_do() -> None:
    (doubt,) = shuffled(75).doubts
    assert "sheetbend.mesh.renumbered(mesh)" in doubt
    assert sb.mesh.renumbered(shuffled(75)).doubts == ()
    assert shuffled(20).doubts == ()
