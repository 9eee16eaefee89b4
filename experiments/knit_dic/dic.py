"""The stretched sheet's recording, and the model that is to explain it. The unit of length is the sheet's width."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import sheetbend as sb
from scipy.interpolate import RegularGridInterpolator
from scipy.sparse import coo_matrix
from scipy.sparse.linalg import spsolve
from sheetbend.mesh import TriangleMesh, grid

DATA = Path(__file__).parent / "data"
STEM = "garter_y_dic_frames01_24"
ATTRIBUTION = json.loads((DATA / f"{STEM}.json").read_text(encoding="utf-8"))["source"]["attribution"]
_arrays = np.load(DATA / f"{STEM}.npz")
ROWS, COLUMNS = (int(n) for n in _arrays["grid"])
REST = _arrays["rest_px"].astype(float)
PX = float(np.ptp(REST[:, 0]))  # of one width
STILLS = _arrays["positions_px"].astype(float)  # (24, ROWS * COLUMNS, 3) px; still k is STILLS[k - 1]
HEIGHT = float(np.ptp(REST[:, 1])) / PX
ORIGIN = np.array([REST[:, 0].min(), REST[:, 1].min(), 0.0])
INSIDE = np.arange(COLUMNS, (ROWS - 1) * COLUMNS)  # points that are not prescribed
CELLS = (22, 6)
FLAT = 1.0  # N m, bending: it keeps the sheet in its plane and does nothing within it
NOISE_PX = 5.0


def scaled(px):
    """Widths, from the lower left corner of the sheet at rest."""
    return (px - ORIGIN) / PX


def rows(still):
    """The two prescribed rows (COLUMNS, 3): the first, at the top of the image, and the last; in widths."""
    points = scaled(STILLS[still - 1]).reshape(ROWS, COLUMNS, 3)
    return points[0], points[-1]


def moved_to(still, uv):
    """Where points of the sheet, (n, 2) at rest, are in a still, (n, 2); in widths."""
    lattice = scaled(REST).reshape(ROWS, COLUMNS, 3)
    x, y = lattice[0, :, 0], lattice[::-1, 0, 1]
    points = scaled(STILLS[still - 1]).reshape(ROWS, COLUMNS, 3)[::-1, :, :2]
    return RegularGridInterpolator((y, x), points)(np.clip(uv, (x[0], y[0]), (x[-1], y[-1]))[:, ::-1])


def places_of(cloth, flat):
    """Places of the points inside, in the triangles of the sheet as it is in still 1."""
    return sb.on_cloth(replace(cloth, mesh=flat), np.clip(scaled(REST[INSIDE])[:, :2], 0.0, (1.0, HEIGHT)))


def missed(rest, places, shape):
    """(points, 3) what coarse triangles between vertices at `shape` miss of the points inside in the still `rest`."""
    if rest == 1:
        return np.zeros((len(places), 3))
    between = np.array([np.array(p.weights) @ shape[list(p.particles)] for p in places])
    return scaled(STILLS[rest - 1])[INSIDE] - between


def experiment(still, law, cells=CELLS, rest=1, change=None):
    """A still as an equilibrium between its first and its last row of points.

    `rest` is the still whose shape is the one without stress; `change(scene, cloth, flat)` adds to the scene, where
    `flat` is the mesh in still 1.
    """
    flat = grid(1.0, HEIGHT, *cells)
    x, y = flat.vertices[:, 0], flat.vertices[:, 1]
    mesh = flat
    if rest != 1:
        shape = moved_to(rest, flat.vertices[:, :2])
        mesh = TriangleMesh(np.column_stack([shape, np.zeros(len(shape))]), flat.triangles, shape, flat.sets)
    top, bottom = rows(still)
    columns = np.linspace(0.0, 1.0, COLUMNS)
    share = (y / HEIGHT)[:, None]
    ends = [np.stack([np.interp(x, columns, row[:, k]) for k in range(3)], axis=1) for row in (bottom, top)]
    held = np.concatenate([flat.sets["bottom"], flat.sets["top"]])
    scene = sb.Scene(f"still_{still}", gravity=(0.0, 0.0, 0.0))
    cloth = sb.add_cloth(
        scene,
        mesh,
        "knit",
        density=1.0,
        warp=1.0,
        weft=1.0,
        shear=0.4,
        poisson=0.3,
        law=law,
        bending=FLAT,
        bending_model="dihedral",
        held=held,
        positions=(1 - share) * ends[0] + share * ends[1],
    )
    scene.pin(cloth.particles[held])
    if change is not None:
        change(scene, cloth, flat)
    places = places_of(cloth, flat)
    shown = scaled(STILLS[still - 1])[INSIDE] - missed(rest, places, mesh.vertices)
    recording = sb.Recording(
        positions=shown[None], times=np.zeros(1), name=scene.name, metadata={"attribution": ATTRIBUTION}
    )
    return sb.Experiment(
        scene=scene, recording=recording, markers=places, static=True, sigma=NOISE_PX / PX, axes="xy", predict=None
    )


def blended(still):
    """Every point of a column between its two prescribed ends, (ROWS, COLUMNS, 3) px."""
    points = STILLS[still - 1].reshape(ROWS, COLUMNS, 3)
    share = np.linspace(0.0, 1.0, ROWS)[:, None, None]
    return (1 - share) * points[0] + share * points[-1]


def harmonic(still):
    """Displacements that are harmonic between the prescribed rows, the sides free, (ROWS, COLUMNS, 3) px."""
    number = np.arange(ROWS * COLUMNS).reshape(ROWS, COLUMNS)
    pairs = [(number[:, :-1], number[:, 1:], np.where(np.isin(np.arange(ROWS), (0, ROWS - 1)), 0.5, 1.0)[:, None])]
    pairs += [(number[:-1], number[1:], np.where(np.isin(np.arange(COLUMNS), (0, COLUMNS - 1)), 0.5, 1.0)[None])]
    i = np.concatenate([a.ravel() for a, _, _ in pairs])
    j = np.concatenate([b.ravel() for _, b, _ in pairs])
    w = np.concatenate([np.broadcast_to(weight, a.shape).ravel() for a, _, weight in pairs])
    size = ROWS * COLUMNS
    parts = [
        coo_matrix((values, (p, q)), (size, size)) for p, q, values in ((i, i, w), (j, j, w), (i, j, -w), (j, i, -w))
    ]
    laplace = sum(parts).tocsr()
    moved = STILLS[still - 1] - REST
    held = np.concatenate([number[0], number[-1]])
    moved[INSIDE] = spsolve(laplace[INSIDE][:, INSIDE], -laplace[INSIDE][:, held] @ moved[held])
    return (REST + moved).reshape(ROWS, COLUMNS, 3)
