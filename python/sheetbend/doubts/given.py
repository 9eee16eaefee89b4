"""What a fit rests on: numbers that were given and not fitted, and what an error in each of them moves.

A fit takes densities, lengths, the direction of gravity, the places of clamps and markers as they are told. With
residuals r, their Jacobian J in the fitted parameters and the derivative g = dr/dgiven of one told number, an error of
that number moves the minimum by -(J'J)^-1 J'g (Gauss-Newton). g comes from one more set of tangents at the minimum:
quantities and gravity through the scene, markers and clamps through what the simulated markers do.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from .. import _core
from ..arrays.checks import is_number
from ..errors import InputError, SheetbendError
from ..experiment.experiment import Experiment
from ..minimum.problem import FitProblem
from ..motion.simulate import divergence
from ..objects.markers import Place
from ..quantities.quantities import Quantity
from ..recording.recording import Recording
from ..result.result import Premise
from ..statistics.gauge import RANK_TOLERANCE
from ..statistics.intervals import NORMAL
from .tangents import tangents

Array = np.ndarray
AXES = "xyz"
DEGREE, MILLIMETER = math.pi / 180.0, 1e-3
STEPS = {"rad": (DEGREE, "1 degree"), "m": (MILLIMETER, "1 mm"), "s": (1e-3, "1 ms")}
GROUPS: Mapping[str, tuple[str, tuple[float, str]]] = {
    "gravity": ("rad", STEPS["rad"]),
    "clamps": ("m", STEPS["m"]),
    "clamp_direction": ("rad", STEPS["rad"]),
    "markers": ("m", (MILLIMETER, "1 mm each")),
}
"""Told numbers that are no quantities, by the name under which a standard deviation is given: unit and step."""
NOTHING_FELT = 1e-9  # of a half-width: a told number that moves less has no part in the fit


@dataclass
class _Told:
    """One told number: J'g for each of its independent errors, by name."""

    unit: str
    step: tuple[float, str]
    value: float | None = None
    relative: bool = False
    columns: dict[str, Array] = field(default_factory=dict)

    def add(self, label: str, column: Array) -> None:
        self.columns[label] = self.columns.get(label, 0.0) + column


def check_given(given: Mapping[str, float], problem: FitProblem) -> None:
    """Refuse standard deviations that are none, or of what the fit does not take as given.

    Raises:
        InputError: names the key.
    """
    u = problem.parameters.initial()
    known = [
        *dict.fromkeys(name for i in range(len(problem.experiments)) for name, *_ in _told(problem, u, i)),
        *GROUPS,
    ]
    for name, sd in given.items():
        if name not in known:
            fix = f"name some of: {', '.join(known)}"
            raise InputError(f"given.{name}", "is nothing that this fit takes as given", name, fix)
        if not (is_number(sd) and sd > 0):
            fix = "give a standard deviation: relative where positive (0.02 is 2 %), else in SI units"
            raise InputError(f"given.{name}", "must be positive", sd, fix)


def premises(problem: FitProblem, u: Array, given: Mapping[str, float]) -> tuple[tuple[Premise, ...], tuple[str, ...]]:
    """What the told numbers would move in the fitted parameters, those without any effect left out; and a warning where
    that cannot be measured, which costs no fit.

    Args:
        u: (free,) the minimum in internal coordinates.
        given: standard deviations by name: of quantities that must be positive relative to the value, of others in
            their unit; "gravity" (each of two directions) and "clamp_direction" in rad, "clamps" (each axis) and
            "markers" (each marker) in m.
    """
    told: dict[str, _Told] = {}
    try:
        ok, _, J = problem.evaluate_exactly(u)
        if not ok:
            raise SheetbendError(problem.failure)
        rows, corrections = problem.core.first_rows, problem.corrections(u)
        for i, (e, r) in enumerate(zip(problem.experiments, problem.recordings, strict=True)):
            _collect(told, problem, u, i, J[rows[i] : rows[i + 1]], e, r, corrections.get(e.name))
    except (SheetbendError, _core.NoEquilibrium) as error:
        uncounted = ", and their standard deviations do not count" if given else ""
        return (), (f"what errors of the given values would move is not known{uncounted}: {error}",)
    solve = _Response(problem, u, J)
    found = tuple(
        premise
        for name, one in told.items()
        for premise in _premises(name, one, solve, given)
        if any(abs(moved) > NOTHING_FELT * abs(solve.size[parameter]) for parameter, moved in premise.moved.items())
    )
    return found, ()


def half_widths(found: tuple[Premise, ...], names: tuple[str, ...]) -> dict[str, float]:
    """Half of the 95 % interval of each parameter, in its unit, from the told standard deviations."""
    return {
        name: NORMAL
        * math.sqrt(sum((p.moved.get(name, 0.0) * p.sd / p.off_by) ** 2 for p in found if p.sd is not None))
        for name in names
    }


class _Response:
    """-(J'J)^-1 on the parameters that the data determine and no bound holds, in physical units."""

    def __init__(self, problem: FitProblem, u: Array, J: Array) -> None:
        lower, upper = problem.parameters.bounds()
        near = 1e-6 * np.maximum(np.abs(u), 1e-3)
        size = np.linalg.norm(J, axis=0)
        held = (u - lower <= near) | (upper - u <= near) | (size == 0)
        self.columns = np.flatnonzero(~held)
        self.names = [problem.parameters.free[k] for k in self.columns]
        scaled = J[:, self.columns] / size[self.columns]
        _, s, Vt = np.linalg.svd(np.linalg.qr(scaled, mode="r"))
        good = s > RANK_TOLERANCE * s.max(initial=0.0)
        self.known = (np.abs(Vt[~good]) < 1e-3).all(axis=0)
        half = Vt[good] / s[good, None]
        self._inverse = half.T @ half / np.outer(size[self.columns], size[self.columns])
        self._diagonal = problem.parameters.diagonal(u)[self.columns]
        deviation = self._diagonal * np.sqrt(np.diag(self._inverse))
        self.size = dict(zip(self.names, deviation.tolist(), strict=True))

    def __call__(self, column: Array) -> Array:
        """What one unit of a told number moves, for J'g (free,)."""
        return np.asarray(-self._diagonal * (self._inverse @ column[self.columns]))


def _premises(name: str, told: _Told, solve: _Response, given: Mapping[str, float]) -> Iterator[Premise]:
    moved = {label: told.step[0] * solve(column) for label, column in told.columns.items()}
    if name == "markers" and moved:  # independent of each other
        moved = {name: np.sqrt(np.square(list(moved.values())).sum(axis=0))}
    sd = given.get(name)
    for label, by in moved.items():
        off_by = told.step[0]
        if told.relative and told.value is not None:
            off_by *= abs(told.value)
        yield Premise(
            name=label,
            value=told.value,
            unit=told.unit,
            off_by=off_by,
            words=told.step[1],
            moved={n: float(m) for n, m, k in zip(solve.names, by, solve.known, strict=True) if k},
            sd=None if sd is None else sd * abs(told.value) if told.relative and told.value is not None else sd,
        )


def _told(problem: FitProblem, u: Array, i: int) -> list[tuple[str, int, float, float, Quantity]]:
    """Per told quantity of an experiment its name (that of the parameter it is tied to), its place among the scene's,
    its value, its factor to what it is tied to, and itself."""
    theta, slots, roots = problem.known(u)
    found = []
    for k, (slot, (name, q)) in enumerate(zip(slots[i], problem.experiments[i].scene.quantities.items(), strict=True)):
        root, factor = roots.get(slot, (name, 1.0))
        if root not in problem.parameters.free:
            found.append((root.partition("[")[0], k, float(theta[slot]), factor, q))
    return found


def _collect(
    told: dict[str, _Told],
    problem: FitProblem,
    u: Array,
    i: int,
    J: Array,
    e: Experiment,
    r: Recording,
    corrected: Array | None,
) -> None:
    """Add one experiment's J'g of everything told; J is that of its own data rows."""
    theta, slots, _ = problem.known(u)
    own = theta[slots[i]]
    gravity = _gravity(e)
    entries: list[tuple[str, str, float, _Told]] = []
    asked: list[tuple[str, int, bool]] = []
    for name, k, value, factor, q in _told(problem, u, i):
        log = q.positive and value > 0
        step = _step(q, value, log)
        if step is None:
            continue
        one = told.setdefault(name, _Told(q.unit, step[1:], value, step[0]))
        entries.append((name, name, 1.0 if log else abs(value) if step[0] else factor, one))
        asked.append((name, k, log))
    names = {f"gravity toward {AXES[axis]}": v for axis, v in gravity.items()}
    unit, step_of = GROUPS["gravity"]
    entries += [("gravity", name, 1.0, told.setdefault("gravity", _Told(unit, step_of))) for name in names]
    columns = np.zeros((len(J), len(entries)))
    if entries:
        columns = tangents(problem, u, i, names, asked, corrected)
        for (_, label, weight, one), column in zip(entries, columns.T, strict=True):
            one.add(label, J.T @ (weight * column))
    by_gravity = dict(zip(gravity, columns.T[len(columns.T) - len(names) :], strict=True))
    _observe(told, J, e, r, corrected, own, by_gravity)


def _step(q: Quantity, value: float, log: bool) -> tuple[bool, float, str] | None:
    """Whether the step of a told quantity is relative, the step, and the step in words; None where none makes sense."""
    if log:
        return True, 0.01, "1 %"
    if q.unit in STEPS:
        return (False, *STEPS[q.unit])
    if value != 0.0 and q.scale is None:
        return True, 0.01, "1 %"
    return None if q.scale is None else (False, 0.1 * q.scale, f"{0.1 * q.scale:g} {q.unit}".rstrip())


def _gravity(e: Experiment) -> dict[int, Array]:
    """Of the two axes that lie most across gravity, what a turn toward each changes of it, m/s^2 per rad."""
    g = e.scene.gravity
    size = float(np.linalg.norm(g))
    if size == 0.0:
        return {}
    down = g / size
    toward = {}
    for axis in sorted(np.argsort(np.abs(down), kind="stable")[:2].tolist()):
        across = np.eye(3)[axis] - down[axis] * down
        toward[axis] = size * across / np.linalg.norm(across)
    return toward


def _observe(
    told: dict[str, _Told],
    J: Array,
    e: Experiment,
    r: Recording,
    corrected: Array | None,
    theta: Array,
    by_gravity: Mapping[int, Array],
) -> None:
    """Add J'g of the places of markers and clamps, from the simulated markers."""
    at, size = e.scene.compiled.layout["position"]
    start = e.scene.compiled.inputs(theta)[at : at + size].reshape(-1, 3)
    slopes = [_slopes(e, place, start) for place in e.compared_places]
    count = max(map(len, slopes))
    shown, moves = _simulated(e, r, corrected, theta, slopes, count)
    frames, seen = np.nonzero(r.mask)
    axes = [AXES.index(a) for a in e.axes]
    marker = np.repeat(seen, len(axes))
    J = J[: len(marker)]  # the rows of the markers; forces do not depend on where these are taken to sit
    by_gravity = {axis: column[: len(marker)] for axis, column in by_gravity.items()}

    def rows(change: Array) -> Array:
        """Residuals' change by the markers' (frames, markers, 3) m; of a robust loss with its weight as it is."""
        return np.asarray(change[frames, seen][:, axes].ravel() / e.sigma)

    unit, step = GROUPS["markers"]
    for k in range(count):
        g = rows(moves[k])
        for m, name in enumerate(e.names):
            if len(slopes[m]) > k:
                mine = marker == m
                one = told.setdefault("markers", _Told(unit, step))
                one.add(f"{name} {k}", J[mine].T @ g[mine])
    held = sorted(e.scene.pinned)
    if not held or e.scene.boundary.driven:
        return  # what is driven moves as the recording says
    for axis in [a for a in range(3) if a in axes]:
        one = told.setdefault("clamps", _Told(*GROUPS["clamps"]))
        one.add(f"clamps along {AXES[axis]}", J.T @ rows(np.broadcast_to(np.eye(3)[axis], shown.shape)))
    if len(e.scene.air.triangles) or len(e.scene.forces.particles):
        return  # which would have to turn as well
    # To turn the clamps is to turn everything, with the gravity turned back.
    arm = shown - start[held].mean(axis=0)
    down = e.scene.gravity
    for axis in range(3):
        turn = np.eye(3)[axis]
        g = rows(np.cross(turn, arm))
        for toward, column in by_gravity.items():
            across = _gravity(e)[toward]
            g = g + column * float(np.cross(down, turn) @ across) / float(across @ across)
        one = told.setdefault("clamp_direction", _Told(*GROUPS["clamp_direction"]))
        one.add(f"clamps about {AXES[axis]}", J.T @ g)


def _slopes(e: Experiment, place: Place, start: Array) -> list[tuple[float, ...]]:
    """What the weights of a place change per meter along the material: once on a rope, twice on a cloth, else never."""
    if any(place.tangent):
        size = 1.0  # the weights of a rope's tangent are per meter, those of a line between particles are not
        if not any(set(place.particles) <= set(rope.particles.tolist()) for rope in e.scene.ropes.values()):
            size = float(np.linalg.norm(np.asarray(place.tangent) @ start[list(place.particles)]))
        return [tuple(t / size for t in place.tangent)] if size > 0 else []
    for cloth in e.scene.cloths.values():
        vertex = {int(p): v for v, p in enumerate(cloth.particles)}
        if len(place.particles) == 3 and all(p in vertex for p in place.particles):
            wanted = [vertex[p] for p in place.particles]
            (triangle,) = np.flatnonzero(np.isin(cloth.mesh.triangles, wanted).all(axis=1))[:1]
            order = [int(np.flatnonzero(cloth.mesh.triangles[triangle] == v)[0]) for v in wanted]
            corners = cloth.mesh.corners[triangle][order]
            inverse = np.linalg.inv(np.column_stack([corners, np.ones(3)]))
            return [tuple(row) for row in inverse[:2].tolist()]
    return []


def _simulated(
    e: Experiment,
    r: Recording,
    corrected: Array | None,
    theta: Array,
    slopes: list[list[tuple[float, ...]]],
    count: int,
) -> tuple[Array, Array]:
    """The simulated markers (frames, markers, 3) m, and what they move per meter of their places along the material
    (count, frames, markers, 3)."""
    d = e.core(r, corrected)
    places, n = e.compared_places, len(e.compared)
    more = [
        replace(p, weights=own[k] if len(own) > k else (0.0,) * len(p.weights), offset=None)
        for k in range(count)
        for p, own in zip(places, slopes, strict=True)
    ]
    every = (1 + count) * n
    measured = np.zeros((len(r.times), every, 3))
    d["observed"] |= {
        "markers": [*d["observed"]["markers"], *(p.core() for p in more)],
        "measured": measured,
        "sigma": np.ones(measured.shape[:2]),
    }
    d["sensors"] = []
    terms = [replace(t, index=3 * every) if np.ravel(t.index)[0] == 3 * n else t for t in e.extra_terms()]
    base = d["map"]["base"]
    map_ = e.scene.compiled.map(3 * every + 1, terms)
    own = e.scene.compiled.core.inputs + 3 * n
    map_["base"][:own] = base[:own]
    d["map"] = map_
    core = _core.Problem(experiments=[d], theta=theta, slots=[list(range(len(theta)))], free=[], threads=1)
    with divergence(e.scene):
        shown = core.simulate(0, np.zeros(0)).reshape(len(r.times), 1 + count, n, 3)
    return shown[:, 0], np.moveaxis(shown[:, 1:], 1, 0)
