"""Numbers that a fit takes as given, and how an error of each would change the residuals.

With g the derivative of the residuals with respect to a told number, g of quantities and of gravity comes from one more
set of tangents. That of markers, clamps and clocks comes from what the simulated markers do.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import _core
from ..arrays.types import Array
from ..errors import SheetbendError
from ..experiment.experiment import Experiment
from ..motion.core_terms import divergence
from ..objects.markers import Place
from ..problem.problem import FitProblem
from ..quantities.quantities import Quantity
from ..recording.recording import Recording
from ..scene.air import WIND
from .absent_friction import OF_IT, SHARE, dry_frictions
from .draft import drafts
from .lead import Lead, leads
from .losses import LOSSES
from .sensor_errors import sensor_errors
from .tangents import Input, Part, tangents
from .told_inputs import AXES, OF_LOSSES, STEPS, gravity_turns, told_inputs
from .told_inputs import GROUPS as OF_INPUTS

Rows = slice | NDArray[np.bool_]

GROUPS: Mapping[str, tuple[str, tuple[float, str]]] = {
    **OF_INPUTS,
    "clamps": ("m", STEPS["m"]),
    "clamp_direction": ("rad", STEPS["rad"]),
    "lead": ("m", STEPS["m"]),
    "markers": ("m", (STEPS["m"][0], "1 mm each")),
    "recording_clock": ("", (1e-3, "0.1 %")),
    "recording_delay": ("s", STEPS["s"]),
    "recording_size": ("", (5e-3, "0.5 %")),
    "drive_place": ("m", STEPS["m"]),
    "draft": ("m/s", (0.2, "0.2 m/s")),  # of which people in a room hardly feel anything
    "marker_offset": ("m", STEPS["m"]),
    "dry_friction": (OF_IT, (SHARE, f"{SHARE:g} {OF_IT}")),
    "force_size": ("", (0.01, "1 %")),
    "force_direction": ("rad", STEPS["rad"]),
    "force_delay": ("s", STEPS["s"]),
    "force_zero": ("N", (0.0, "")),  # of each sensor its sigma
    "torque_zero": ("N m", (0.0, "")),
}
"""Told numbers that are no quantities, by the name under which a standard deviation is given: unit ("" where it is
relative) and step."""
TAKEN = (*LOSSES, "_friction", "_dissipation")
"""Ends of the names of quantities that take energy, friction and what contacts dissipate among them."""
GUESSED = 0.05
"""Step of Poisson's ratio and of a restitution: as losses, they are estimated rather than measured. A Poisson's ratio
of 0.3, told as 0.45, made the E of a swinging bar 10 % too large."""
LATER, SLOWER, LARGER = "recording delay", "frame rate", "size of the recording"
ASIDE, DRAFT, BESIDE = "offset of driven motion", "draft along", "offset of markers"
_NONE = np.zeros(0)


@dataclass(frozen=True)
class Told:
    """One told number of one experiment, and what an error of it changes.

    Attributes:
        experiment: its place among those of the problem.
        name: under which a standard deviation is given; "" for what has none (such as what the model lacks).
        label: of this error, such as "gravity toward x".
        unit: of the number.
        step: the error whose effect a report tells, and that in words.
        column: derivative of some of the experiment's residuals with respect to it, or to its logarithm.
        rows: which of the experiment's rows these are; those left out do not change.
        value: of a quantity.
        relative: whether `step` and `column` are.
        marker: whose place it is.
        missing: of what has no number in the model, such as what it lacks (`missing_parts`): what a size of it says.
        signed: whether there may be less than none of what is missing.
        added: what one unit of it adds to inputs of the scene, of what is an error of these.
        shared: whether all of several motions have it.
    """

    experiment: int
    name: str
    label: str
    unit: str
    step: tuple[float, str]
    column: Array
    rows: Rows = field(default_factory=lambda: slice(None))
    value: float | None = None
    relative: bool = False
    marker: str = ""
    missing: Callable[[float], str] | None = None
    signed: bool = False
    added: Array | Input | list[Input] | None = None
    shared: bool = False


def told_numbers(problem: FitProblem, u: Array) -> tuple[list[Told], str]:
    """All told numbers at the minimum u (free,), and why none are known where they cannot be told."""
    try:
        ok, _, _ = problem.evaluate_exactly(u)
        if not ok:
            raise SheetbendError(problem.failure)
        corrections = problem.corrections(u)
        every = [(i, problem.experiment_at(i, u), r) for i, r in enumerate(problem.recordings)]
        return [one for i, e, r in every for one in _collect(problem, u, i, e, r, corrections.get(e.name))], ""
    except (SheetbendError, _core.NoEquilibrium) as error:
        return [], str(error)


def of_parts(problem: FitProblem, u: Array, i: int, parts: Sequence[Part], corrected: Array | None) -> list[Told]:
    """Directions of parts that the i-th experiment's model may lack; none where its motion has no answer at u (free,).
    Takes one set of tangents.

    Args:
        corrected: the experiment's corrections there (`FitProblem.corrections`).
    """
    if not parts:
        return []
    try:
        columns = tangents(problem, u, i, {label: added for label, added, _ in parts}, corrected=corrected)
    except SheetbendError:
        return []
    signed = ("velocity", "rest", "position")
    return [
        Told(i, "", label, "", (0.0, ""), column, missing=says, signed=added[0] in signed, added=added)
        for (label, added, says), column in zip(parts, columns.T, strict=True)
    ]


def told_quantities(problem: FitProblem, u: Array, i: int) -> list[tuple[str, int, float, float, Quantity]]:
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
    problem: FitProblem, u: Array, i: int, e: Experiment, r: Recording, corrected: Array | None
) -> Iterator[Told]:
    theta, slots, _ = problem.known(u)
    own = theta[slots[i]]
    made: list[tuple[float, Told]] = []
    asked: list[tuple[str, int, bool]] = []
    for name, k, value, factor, q in told_quantities(problem, u, i):
        log = q.positive and value > 0
        step = _step(q, value, log)
        if step is None:
            continue
        weight = 1.0 if log else abs(value) if step[0] else factor
        made.append((weight, Told(i, name, name, q.unit, step[1:], _NONE, value=value, relative=step[0])))
        asked.append((name, k, log))
    blown, moves = drafts(problem, u, i)
    added: dict[str, Any] = {}  # by any names, for two errors may share a label
    for given in told_inputs(e, own):
        one = Told(i, given.name, given.label, given.unit, given.step, _NONE, missing=given.says)
        one = replace(one, signed=given.says is not None, relative=not (given.unit or given.says), added=given.added)
        made.append((1.0, one))
        added[f"{given.label}, {len(added)}"] = given.added
    for axis, more in enumerate(moves):
        label = f"{DRAFT} {AXES[axis]}"
        made.append((1.0, Told(i, "draft", label, *GROUPS["draft"], _NONE)))
        added[f"{label}, {len(added)}"] = more
    lengths = {name: (k, own[place] if log else 1.0) for k, (name, place, log) in enumerate(asked)}
    stuck_out = [lead for lead in leads(e.scene, e.scene.compiled.inputs(own)) if f"{lead.rope}_length" in lengths]
    added |= {f"{lead.label}, {len(added) + k}": lead.added for k, lead in enumerate(stuck_out)}
    by_gravity: dict[int, Array] = {}
    sticking: list[tuple[Lead, Array]] = []
    if made:
        columns = tangents(blown, u, i, added, asked, corrected)
        for (weight, told), column in zip(made, columns.T[: len(made)], strict=True):
            yield replace(told, column=weight * column)
        by_gravity = {axis: columns[:, len(asked) + n] for n, axis in enumerate(gravity_turns(e))}
        behind = len(columns.T) - len(stuck_out)
        for lead, column in zip(stuck_out, columns.T[behind:], strict=True):
            k, value = lengths[f"{lead.rope}_length"]
            sticking.append((lead, column + columns[:, k] / value))
    for dry in dry_frictions(problem, u, i, corrected):
        yield Told(i, "dry_friction", dry.label, *GROUPS["dry_friction"], dry.column, missing=dry.says)
    for error in sensor_errors(problem, u, i):
        unit = GROUPS[error.name][0]
        one = Told(i, error.name, error.label, unit, error.step, error.column, relative=not unit)
        yield replace(one, missing=error.says, signed=True)
    if not e.is_cloud:
        yield from _observe(problem, i, e, r, corrected, own, by_gravity, sticking)


def _step(q: Quantity, value: float, log: bool) -> tuple[bool, float, str] | None:
    """Whether the step of a told quantity is relative, the step, and the step in words; None where none makes sense."""
    if log:
        unsure = max(q.unsure, OF_LOSSES[0] if q.name.endswith(TAKEN) else 0.0)
        return True, unsure, f"{100 * unsure:g} %"
    if q.name.endswith(("_poisson", "_restitution")):
        return False, GUESSED, f"{GUESSED:g}"
    if q.name.startswith(WIND):
        return (False, *GROUPS["draft"][1])
    if q.unit in STEPS:
        return (False, *STEPS[q.unit])
    if value != 0.0 and q.scale is None:
        return True, 0.01, "1 %"
    return None if q.scale is None else (False, 0.1 * q.scale, f"{0.1 * q.scale:g} {q.unit}".rstrip())


def _observe(
    problem: FitProblem,
    i: int,
    e: Experiment,
    r: Recording,
    corrected: Array | None,
    theta: Array,
    by_gravity: Mapping[int, Array],
    sticking: Sequence[tuple[Lead, Array]],
) -> Iterator[Told]:
    """Places of markers and clamps, and the clock, from the simulated markers."""
    at, size = e.scene.compiled.layout["position"]
    start = e.scene.compiled.inputs(theta)[at : at + size].reshape(-1, 3)
    slopes = [_slopes(e, place, start) for place in e.compared_places]
    count = max(map(len, slopes))
    shown, moves = _simulated(e, r, corrected, theta, slopes, count)
    frames, seen = np.nonzero(r.mask)
    axes = [AXES.index(a) for a in e.axes]
    marker = np.repeat(seen, len(axes))
    left = (shown - r.positions)[frames, seen][:, axes] / e.sigma
    own = slice(0, len(marker))  # the rows of the markers; forces do not depend on where these are taken to sit

    def change(label: str, name: str, by: Array, **more: Any) -> Told:
        """By the markers' (frames, markers, 3) m."""
        rows = _of_loss(e, left, by[frames, seen][:, axes] / e.sigma).ravel()
        return Told(i, name, label, *GROUPS[name], rows, **({"rows": own} | more))

    for k in range(count):
        whole = change("markers", "markers", moves[k])
        for m, name in enumerate(e.names):
            if len(slopes[m]) > k:
                mine = np.zeros(problem.core.first_rows[i + 1] - problem.core.first_rows[i], dtype=bool)
                mine[own] = marker == m
                yield replace(whole, label=f"{name} {k}", column=whole.column[marker == m], rows=mine, marker=name)
    for lead, column in sticking:
        if lead.from_start and count:
            farther = np.array([lead.moves(e.scene, place) for place in e.compared_places])
            column = column.copy()
            column[own] += change("", "lead", moves[0] * farther[:, None]).column
        yield Told(i, "lead", lead.label, *GROUPS["lead"], column, missing=lead.says, signed=True)
    for axis in range(3) if count == 1 else ():  # of ropes
        yield change(f"{BESIDE} {AXES[axis]}", "marker_offset", np.cross(moves[0], np.eye(3)[axis]))
    held, boundary = sorted(e.scene.pinned, key=e.scene.places_of), e.scene.boundary
    if not e.static and e.time_offset is None and len(r.times) > 1 and not boundary.following:
        speed = np.gradient(shown, r.times, axis=0)
        yield change(LATER, "recording_delay", speed)
        yield change(SLOWER, "recording_clock", speed * (r.times - e.t0)[:, None, None], relative=True)
    aside = [(AXES[a], np.broadcast_to(np.eye(3)[a], shown.shape)) for a in range(3) if a in axes]
    if boundary.driven and not e.scene.contacts.contacts:  # a table would have to move as well
        for way, moved in aside:
            yield change(f"{ASIDE} {way}", "drive_place", moved)
    if held and not boundary.driven:  # what is driven goes where it was measured
        for way, moved in aside:
            yield change(f"clamps along {way}", "clamps", moved)
        arm = shown - start[held].mean(axis=0)
        yield change(LARGER, "recording_size", arm, relative=True)
        if not len(e.scene.air.times) and not len(e.scene.forces.particles):  # which would have to turn as well
            yield from _turned_clamps(e, arm, change, by_gravity)


def _turned_clamps(
    e: Experiment, arm: Array, change: Callable[[str, str, Array], Told], by_gravity: Mapping[int, Array]
) -> Iterator[Told]:
    """To turn the clamps is to turn everything, the markers at `arm` (frames, markers, 3) m from them, with the gravity
    turned back."""
    for axis in range(3):
        turn = np.eye(3)[axis]
        turned = change(f"clamps about {AXES[axis]}", "clamp_direction", np.cross(turn, arm))
        g = turned.column
        for toward, column in by_gravity.items():
            across = gravity_turns(e)[toward]
            g = g + column[: len(g)] * float(np.cross(e.scene.gravity, turn) @ across) / float(across @ across)
        yield replace(turned, column=g)


def _of_loss(e: Experiment, d: Array, by: Array) -> Array:
    """(n, axes) what a change `by` of markers' weighted distances d, both (n, axes), makes of their residuals, which a
    robust loss shortens (adjoint/observe/observation.h). By complex step."""
    if e.loss == "squares":
        return by
    moved = d + 1e-30j * by
    s = (moved**2).sum(axis=1, keepdims=True) / e.loss_scale**2
    if e.loss == "soft_l1":
        factor = np.sqrt(2.0 / (1.0 + np.sqrt(1.0 + s)))
    else:
        far = np.where(s.real > 1.0, s, 1.0)
        factor = np.sqrt((2.0 * np.sqrt(far) - 1.0) / far)
    return np.asarray((factor * moved).imag / 1e-30)


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
        "markers": [*d["observed"]["markers"], *(p.core(e.scene) for p in more)],
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
