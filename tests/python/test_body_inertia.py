"""Inertia of shapes, meshes and welded bodies; rotations; poses as markers; expressions of quantities."""

from __future__ import annotations

import numpy as np
import pytest
import sheetbend as sb
from sheetbend.arrays.rotations import matrices_of, quaternions_of, rotation_matrix
from sheetbend.quantities.expression import Expression, expressions, numbers, rotation, terms_of, vector

SIDES = np.array([0.1, 0.2, 0.3])
TURN = np.array([0.3, -0.5, 0.8])


def box_mesh(sides: np.ndarray, at: np.ndarray) -> sb.TriangleMesh:
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float) - 0.5
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    triangles = np.array([t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))])
    flat = np.tile([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]], (len(triangles), 1, 1))
    return sb.TriangleMesh(corners * sides + at, triangles, flat)


def test_box_has_the_inertia_of_the_oracle_and_axes_of_its_second_moments() -> None:
    box = sb.Inertia.box(1.0, SIDES)
    assert np.allclose(np.diag(box.matrix), [0.01083333333, 0.00833333333, 0.00416666667], rtol=1e-9)
    moments, axes = box.principal()
    assert (axes == np.eye(3)).all()
    assert np.allclose(moments.sum() / 2 - moments, SIDES**2 / 12, rtol=1e-14)


def test_mesh_of_a_box_far_from_zero_weighs_what_the_box_does() -> None:
    at = np.array([10.0, -20.0, 30.0])
    found = sb.Inertia.of_mesh(box_mesh(SIDES, at), 500.0)
    wanted = sb.Inertia.box(500.0 * SIDES.prod(), SIDES)
    assert found.mass == pytest.approx(wanted.mass, rel=1e-12)
    assert np.allclose(found.center, at, rtol=1e-13)
    assert np.allclose(found.matrix, wanted.matrix, rtol=0, atol=1e-12 * wanted.matrix.max())


def test_open_and_inverted_meshes_are_refused() -> None:
    mesh = box_mesh(SIDES, np.zeros(3))
    for triangles, match in ((mesh.triangles[1:], "not a closed surface"), (mesh.triangles[:, ::-1], "inside out")):
        flat = np.tile([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]], (len(triangles), 1, 1))
        with pytest.raises(sb.SceneError, match=match):
            sb.Inertia.of_mesh(sb.TriangleMesh(mesh.vertices, triangles, flat), 500.0)


def test_halves_welded_together_are_the_whole_also_when_turned() -> None:
    half = sb.Inertia.box(0.5, SIDES * [0.5, 1.0, 1.0])
    parts = [half.moved((x, 0.0, 0.0)) for x in (-0.025, 0.025)]
    whole, turned = sb.Inertia.box(1.0, SIDES), sb.Inertia.welded([p.moved((1.0, 2.0, 3.0), TURN) for p in parts])
    assert np.allclose(sb.Inertia.welded(parts).matrix, whole.matrix, rtol=1e-13)
    assert np.allclose(turned.center, [1.0, 2.0, 3.0], rtol=1e-13)
    assert np.allclose(turned.principal()[0], sorted(np.diag(whole.matrix)), rtol=1e-12)
    assert np.allclose(turned.about((1.0, 2.0, 4.0)), turned.matrix + np.diag([1.0, 1.0, 0.0]), rtol=1e-12)
    axes = turned.principal()[1]
    assert np.allclose(axes @ np.diag(turned.principal()[0]) @ axes.T, turned.matrix, rtol=1e-12)
    assert np.linalg.det(axes) == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("inertia", "match"),
    [
        ([1.0, 1.0, 3.0], "that of no body"),  # about a joint, not about the center
        ([1.0, 1.0, 2.0], "that of no body"),  # a disk without thickness
        ([[1.0, 0.1, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], "not a symmetric matrix"),
        ([1.0, 1.0], "not a symmetric matrix"),
    ],
)
def test_inertia_that_no_body_has_is_refused(inertia: list[float], match: str) -> None:
    with pytest.raises(sb.SceneError, match=match):
        sb.Inertia(1.0, inertia)


def test_rotations_agree_in_all_three_forms() -> None:
    matrix = rotation_matrix("turn", TURN)
    assert np.allclose(matrix @ TURN, TURN)
    assert np.trace(matrix) == pytest.approx(1.0 + 2.0 * np.cos(np.linalg.norm(TURN)), rel=1e-14)
    quaternion = quaternions_of(matrix)
    assert np.allclose(rotation_matrix("turn", 3.0 * quaternion), matrix, atol=1e-15)
    assert np.allclose(rotation_matrix("turn", matrix), matrix, atol=1e-15)
    half_turns = np.stack([2.0 * np.outer(a, a) - np.eye(3) for a in np.eye(3)])
    assert np.allclose(matrices_of(quaternions_of(half_turns)), half_turns, atol=1e-14)
    for wrong, match in ((np.diag([1.0, 1.0, -1.0]), "reflection"), (2.0 * np.eye(3), "orthonormal")):
        with pytest.raises(sb.SceneError, match=match):
            rotation_matrix("turn", wrong)


def test_expressions_are_the_products_that_they_say() -> None:
    names = ["a", "b", "c"]
    at = dict(zip(names, TURN, strict=True))
    matrix = numbers(rotation(names), at)
    x, y, z = (rotation_matrix("turn", angle * axis) for angle, axis in zip(TURN, np.eye(3), strict=True))
    assert np.allclose(matrix, z @ y @ x, atol=1e-15)
    place = rotation(names) @ (vector(names) - expressions([1.0, 2.0, 3.0])) * 2.0
    assert np.allclose(numbers(place, at), 2.0 * matrix @ (TURN - [1.0, 2.0, 3.0]), atol=1e-14)
    terms = terms_of("position", np.arange(3), place)
    found = np.zeros(3)
    for t in terms:
        found[t.index] += t.coefficient * Expression({t.factors: 1.0}).at(at)
    assert np.allclose(found, numbers(place, at), atol=1e-14)


def test_recorded_poses_become_markers_and_show_the_state_at_the_start() -> None:
    gravity, spin, velocity = np.array([0.0, 0.0, -9.81]), np.array([3.0, -2.0, 5.0]), np.array([0.5, 0.2, 1.0])
    t = 2.0 + np.arange(8) / 100
    s = (t - 2.0)[:, None]
    first = rotation_matrix("turn", TURN)
    frames = np.stack([rotation_matrix("turn", spin * k) @ first for k in s[:, 0]])
    x = np.array([1.0, 2.0, 3.0]) + s * velocity + 0.5 * s**2 * gravity
    q = quaternions_of(frames) * np.where(np.arange(8) % 2, -1.0, 1.0)[:, None]  # the sign of a quaternion says nothing
    start = sb.start_of_poses(t, x, q, gravity)
    assert np.allclose(start["at"], [1.0, 2.0, 3.0], atol=1e-13)
    assert np.allclose(start["velocity"], velocity, atol=1e-11)
    assert np.allclose(start["rotation"], first, atol=1e-12)
    assert np.allclose(start["spin"], spin, atol=1e-11)
    points = np.array([[0.1, 0.0, 0.0], [0.0, 0.2, 0.3]])
    taken = sb.Recording.from_poses(t, x, q, points, name="toss")
    assert taken.markers == ("p0", "p1")
    assert np.allclose(taken.positions, x[:, None] + np.einsum("fab,kb->fka", frames, points), atol=1e-14)
    with pytest.raises(sb.RecordingError, match="wrong shape"):
        sb.Recording.from_poses(t, x, q[:, :3], points)
    with pytest.raises(sb.RecordingError, match="do not show a state"):
        sb.start_of_poses(t[:1], x[:1], q[:1])
