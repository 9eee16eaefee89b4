"""How the clamp of a short beam of bricks changes its sag and its first frequency, beside Timoshenko's beam.

Run from the repository's root: python experiments/beam/clamps.py. It solves the linearized problem by itself, with the
bricks of docs/solids.md: shear at eight Gauss points, one mean volume. It prints a table of the README.
"""

from __future__ import annotations

import numpy as np
import sheetbend as sb
from scipy import sparse
from scipy.sparse.linalg import splu
from solid import DENSITY, POISSON, SIDE, E

LENGTH = 0.1  # m
MU, LAMBDA = E / (2 * (1 + POISSON)), E * POISSON / ((1 + POISSON) * (1 - 2 * POISSON))
GRAVITY = 9.81
MESHES = ((7, 2, 2), (10, 3, 3), (14, 4, 4), (20, 6, 6))
CLAMPS = ("pinned", "four corners", "mean")
Array = np.ndarray


def brick_stiffness(corners: Array) -> Array:
    """(24, 24) N/m of a brick from its corners (8, 3), m."""
    low, sides = corners.min(axis=0), np.ptp(corners, axis=0)
    signs = np.where(corners > low + sides / 2, 1.0, -1.0)
    volume, stiffness, mean = sides.prod(), np.zeros((24, 24)), np.zeros((8, 3))
    for point in signs / np.sqrt(3.0):
        f = 1.0 + signs * point
        slopes = signs / (4.0 * sides) * f[:, [1, 2, 0]] * f[:, [2, 0, 1]]
        strain = np.zeros((3, 3, 8, 3))
        for i in range(3):
            strain[i, :, :, i] += 0.5 * slopes.T
            strain[:, i, :, i] += 0.5 * slopes.T
        rows = strain.reshape(9, 24)
        stiffness += 2.0 * MU * volume / 8.0 * rows.T @ rows
        mean += slopes / 8.0
    return np.asarray(stiffness + LAMBDA * volume * np.outer(mean, mean))


def held(mesh: sb.SolidMesh, clamp: str) -> sparse.csr_matrix:
    """Rows of what stands still."""
    face, x = mesh.sets["x_min"], mesh.vertices
    areas = mesh.areas(face)
    corners = face[(np.abs(x[face][:, 1:]) > SIDE / 2 - 1e-9).all(axis=1)]
    rows = [{3 * v + axis: 1.0} for v in face for axis in (range(3) if clamp == "pinned" else (0,))]
    if clamp == "four corners":
        rows += [{3 * v + 2: 1.0} for v in corners]
    elif clamp == "mean":
        rows += [dict(zip(3 * face + 2, areas, strict=True)), dict(zip(3 * face + 2, areas * x[face, 1], strict=True))]
    if clamp != "pinned":
        rows += [dict(zip(3 * face + 1, areas, strict=True))]
    made = sparse.lil_matrix((len(rows), x.size))
    for k, row in enumerate(rows):
        for place, value in row.items():
            made[k, place] = value
    return made.tocsr()


def bricks(cells: tuple[int, int, int], clamp: str) -> tuple[float, float]:
    """Sag m of the tip's mean, and the square of the first angular frequency."""
    mesh = sb.mesh.bricks((LENGTH, SIDE, SIDE), cells, at=(0.0, -SIDE / 2, -SIDE / 2))
    own = brick_stiffness(mesh.vertices[mesh.elements[0]])
    places = (3 * mesh.elements[:, :, None] + np.arange(3)).reshape(len(mesh.elements), 24)
    index = np.repeat(places, 24, axis=1).ravel(), np.tile(places, (1, 24)).ravel()
    size = mesh.vertices.size
    matrix = sparse.csr_matrix((np.tile(own.ravel(), len(places)), index), shape=(size, size))
    volume = LENGTH * SIDE**2 / len(mesh.elements)
    mass = np.repeat(np.bincount(mesh.elements.ravel()) * DENSITY * volume / 8.0, 3)
    rows = held(mesh, clamp) * abs(matrix).max()
    factor = splu(sparse.bmat([[matrix, rows.T], [rows, None]]).tocsc())

    def moved(force: Array) -> Array:
        return np.asarray(factor.solve(np.append(force, np.zeros(rows.shape[0])))[:size])

    tip = mesh.sets["x_max"]
    sag = np.average(moved(-GRAVITY * mass * (np.arange(size) % 3 == 2))[3 * tip + 2], weights=mesh.areas(tip))
    x = (np.arange(size) % 3 == 2) * 1.0
    for _ in range(30):
        y = moved(mass * x)
        square, x = float(y @ (mass * x) / (y @ (mass * y))), y / np.sqrt(y @ (mass * y))
    return float(-sag), square


def timoshenko(links: int = 200, rotational: float = 0.0) -> tuple[float, float]:
    """The same of Timoshenko's beam; `rotational` counts the inertia of its sections."""
    area, bend, h = SIDE**2, SIDE**4 / 12, LENGTH / links
    matrix, mass = np.zeros((2 * links + 2,) * 2), np.zeros(2 * links + 2)
    for k in range(links):
        own = slice(2 * k, 2 * k + 4)
        turn, shear = np.array([0.0, -1.0, 0.0, 1.0]) / h, np.array([-1.0 / h, -0.5, 1.0 / h, -0.5])
        matrix[own, own] += h * (E * bend * np.outer(turn, turn) + 5 / 6 * MU * area * np.outer(shear, shear))
        mass[own] += DENSITY * h / 2 * np.array([area, bend * rotational] * 2)
    matrix, mass = matrix[2:, 2:], mass[2:]
    sag = np.linalg.solve(matrix, GRAVITY * mass * (np.arange(len(mass)) % 2 == 0))[-2]
    values = np.linalg.eigvals(np.linalg.solve(matrix, np.diag(mass)))
    return float(sag), float(1.0 / values.real.max())


if __name__ == "__main__":
    sag, square = timoshenko()
    print(f"Timoshenko: {1e3 * sag:.3f} mm, {np.sqrt(square) / (2 * np.pi):.3f} Hz")
    print(f"frequency squared with rotational inertia: {timoshenko(rotational=1.0)[1] / square:.3f}")
    for cells in MESHES:
        found = [bricks(cells, clamp) for clamp in CLAMPS]
        parts = [f"{a / sag:.3f}" for a, _ in found] + [f"{b / square:.3f}" for _, b in found]
        print(" | ".join([" x ".join(map(str, cells)), *parts]), flush=True)
