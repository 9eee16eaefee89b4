"""What contradicts a minimum: separate parts of the data, another start, and motion that was held out."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from ..arrays.timeseries import mean_position
from ..arrays.types import Array
from ..experiment.cut import start_quantities
from ..experiment.experiment import Experiment
from ..minimum.discretization import Refinement
from ..minimum.time_step import SECOND_ORDER, halved
from ..problem.lifted import WithStates
from ..problem.problem import FitProblem
from ..quantities.parameters import Parameter
from ..quantities.wording import figures, short
from ..result.estimate import UNSOUND, Estimate
from ..result.motions import RecordingFit
from ..statistics.blocks import FEWEST, MOST_COLUMNS, Difference, Split, contradiction
from ..statistics.identifiability import Identifiability
from ..statistics.intervals import reach_of
from ..statistics.left_out import LeftOut, left_out
from ..statistics.linearized import Linearized
from ..statistics.profile import FARTHEST, NOISELESS
from .driven_errors import driven_errors
from .prediction import Comparison
from .profiles import Elsewhere

CLAIMS = ("identified", "weak", "one-sided")  # verdicts that can be contradicted
DENIES = "not identifiable"  # that the data know a parameter
ORDINALS = ("first", "second", "third")
MOST_RECORDINGS = 24
"""Recordings, or groups of them where there are more, that are compared. A single one of n that moves the estimate by
its half-width differs from the others by 2 sqrt(n) standard deviations, and its group of n/24 still by 2 sqrt(24)."""
FEWEST_MARKERS = 4  # that are compared by halves
SEEN = 3.0  # times sigma: an error that can be told from noise
TRADES = 0.3  # correlation from which on a parameter shares the error of another
APART = 2.0  # half-widths from the estimate: another minimum


def doubtful(
    estimates: Sequence[Estimate], doubts: Mapping[str, str], of_all: Mapping[str, str] | None = None
) -> tuple[Estimate, ...]:
    """The estimates, "doubtful" in place of a claim where there is a doubt, with its words.

    Args:
        of_all: those that leave no statement standing, that the data do not know a parameter neither.
    """
    of_all = of_all or {}
    return tuple(
        replace(e, verdict="doubtful", words=f"{doubts[e.name]} (otherwise {e.verdict}, {e.words})")
        if e.name in doubts and (e.verdict in CLAIMS or (e.name in of_all and e.verdict == DENIES))
        else e
        for e in estimates
    )


def together(*doubts: Mapping[str, str]) -> dict[str, str]:
    """By parameter, all sentences that speak against it, in the order of the doubts."""
    words: dict[str, list[str]] = {}
    for each in doubts:
        for name, why in each.items():
            words.setdefault(name, []).append(why)
    return {name: "; and ".join(why) for name, why in words.items()}


def between_parts(
    problem: FitProblem, u: Array, judged: Identifiability, refinement: Refinement | None = None
) -> dict[str, str]:
    """By parameter, why separate parts of the data (time, markers, recordings) ask for different values.

    All parameters together must differ between the parts by more than chance explains at the 1 % level. Those are named
    of which a part differs from the others by more than its 95 % interval, and from the estimate by more than the
    estimate's, what the discretization moves in that part counted; those which the data without a part know, and place
    farther from the estimate than either interval reaches; and those of which recordings scatter by more than the
    estimate's interval tells. No simulation is needed beyond the last Jacobian,
    unless parts differ: then what noise of driven particles does to all parts alike counts too (`driven_errors`).

    Args:
        refinement: of the discretization; where parts differ, one simulation each tells what it explains of that.
            Parts must differ both with and without it. Where the refinement widens an interval more than noise does,
            parts mostly differ only without it, so the simulations come first.
    """
    coarse = refinement is not None and any(e.discretization > (e.statistical or 0.0) for e in judged.estimates)
    words = {} if coarse else _between(problem, u, judged, [])
    if not (coarse or words):
        return {}
    shifts = residual_shifts(problem, u, refinement) if refinement is not None else []
    errors = driven_errors(problem, u)
    found = _between(problem, u, judged, shifts, errors) if coarse or shifts or errors.size else words
    return {} if coarse and found and not _between(problem, u, judged, []) else found


def _between(
    problem: FitProblem, u: Array, judged: Identifiability, shifts: Sequence[Array], errors: Array | None = None
) -> dict[str, str]:
    _, r, J = problem.evaluate(u)
    rows, names = problem.core.data_rows, problem.parameters.free
    estimates = {e.name: e for e in judged.estimates}
    inside = problem.parameters.inside(u)
    used = [column for column, name in enumerate(names) if estimates[name].verdict not in UNSOUND and inside[column]]
    if not used or not np.isfinite(J[:, used]).all() or float(r[:rows] @ r[:rows]) < NOISELESS * rows:
        return {}
    layout, within = problem.rows_layout(), _private(problem, J[:rows, used])
    known = np.column_stack(shifts) if shifts else None
    taken = problem.absorbed
    free = problem.with_states(u)
    every = splits(problem, J[:rows, used], free)
    J = J[:, used]
    if free is not None:
        J, within = _beside_states(problem, free, used, within)
        taken -= J.shape[1] - len(used)  # each state counts as one number, as what is solved for within a recording
    fitted = Linearized(r, J, layout, within, known, taken, errors)
    found = contradiction(fitted, every)
    if found is None:
        return {}
    words, lack = {}, _lack(problem)
    for d in found.differences:
        name, column = names[used[d.column]], used[d.column]
        reach = reach_of(problem.parameters[name], estimates[name]) + SECOND_ORDER * d.shift
        if abs(d.steps[0] - d.steps[1]) > d.reach + SECOND_ORDER * d.shift and abs(d.steps[0]) > reach:
            words[name] = _difference_words(problem.parameters[name], u[column], d, lack)
    for without in left_out(fitted, found.split):
        name, column = names[used[without.column]], used[without.column]
        p = problem.parameters[name]
        reach = max(reach_of(p, estimates[name]), without.reach)
        by_mesh = SECOND_ORDER * without.shift
        if name not in words and abs(without.step) > reach + by_mesh:
            words[name] = _without_words(p, u[column], without, lack)
        elif name not in words and found.split.apart and without.surely > reach_of(p, estimates[name]) + by_mesh:
            words[name] = _scatter_words(p, u[column], without)
    return drawn_along(judged, words)


def drawn_along(judged: Identifiability, words: Mapping[str, str]) -> dict[str, str]:
    """The doubts with those of the parameters that trade with the doubtful ones, whose errors they share."""
    along: dict[str, str] = {}
    for pair in sorted(judged.correlations, key=lambda pair: -abs(pair.value)):
        for one, other in ((pair.first, pair.second), (pair.second, pair.first)):
            if abs(pair.value) >= TRADES and other in words and one not in words:
                why = f"is correlated with {other} ({pair.value:+.2f}), about which parts of the data disagree"
                along.setdefault(one, why)
    return {**along, **words}


def finer_experiments(problem: FitProblem, refinement: Refinement) -> list[Sequence[Experiment]]:
    """The fitted experiments at half the step and on a finer mesh, where these are asked for."""
    finer: list[Sequence[Experiment]] = []
    if refinement.halve_step and any(not e.static for e in problem.experiments):
        finer.append(halved(problem.experiments))
    if refinement.finer is not None:
        finer.append([e for e in refinement.finer() if e.predict is None])
    return finer


def residual_shifts(problem: FitProblem, u: Array, refinement: Refinement) -> list[Array]:
    """(rows,) what the data's residuals change at half the step and on a finer mesh, where these are asked for. One
    that has no answer there is left out."""
    _, r, _ = problem.evaluate(u)
    shifts, rows = [], problem.core.data_rows
    for experiments in finer_experiments(problem, refinement):
        finer = FitProblem(experiments, problem.given, threads=problem.threads).follow(problem)
        ok, there, _ = finer.evaluate(u, jacobian=False)
        if ok:
            shifts.append(there[:rows] - r[:rows])
    return shifts


def _lack(problem: FitProblem) -> str:
    """What contradicting parts mean; where states at borders of windows could be freed, pushes are named, which move a
    real motion off its model a little at every instant."""
    windows = any(not e.static and e.shooting is None and start_quantities(e.scene) for e in problem.experiments)
    such = ", such as small pushes along the motion (`shooting` allows for them)" if windows else ""
    return f"the model lacks something{such}, or this is not the lowest minimum"


def _difference_words(p: Parameter, at: float, found: Difference, lack: str) -> str:
    said = [value_words(p, at, step, reach) for step, reach in zip(found.steps, found.reaches, strict=True)]
    return (
        f"parts of the data contradict each other: {said[0]} from {found.name}, {said[1]} from the rest (to first "
        f"order); {lack}"
    )


def _without_words(p: Parameter, at: float, found: LeftOut, lack: str) -> str:
    value = value_words(p, at, found.step, found.reach)
    return f"parts of the data contradict each other: without {found.name} it would be {value} (to first order); {lack}"


def _scatter_words(p: Parameter, at: float, found: LeftOut) -> str:
    value = value_words(p, at, 0.0, found.scatter)
    return (
        "parts of the data contradict each other: recordings differ by more than noise explains. From their scatter it "
        f"would be {value} (each left out in turn, to first order); the model lacks something that differs between them"
    )


def value_words(p: Parameter, at: float, step: float, reach: float) -> str:
    """The value an internal step away from a point, with its half-width."""
    center, reach = (min(max(x, -FARTHEST), FARTHEST) for x in (step, reach)) if p.log else (step, reach)
    value = p.to_physical(at + center)
    half = (p.to_physical(at + center + reach) - p.to_physical(at + center - reach)) / 2
    number, width = figures((value, half), half)
    return f"{number} +/- {width} {p.unit}".rstrip()


def _private(problem: FitProblem, jacobian: Array) -> list[tuple[slice, list[int]]]:
    """Rows of each experiment and the columns that only it has, where there are several."""
    first, count = problem.core.first_rows, len(problem.experiments)
    if count < 2:
        return []
    parts = [slice(first[i], first[i + 1]) for i in range(count)]
    has = np.array([jacobian[part].any(axis=0) for part in parts])
    return [
        (part, np.flatnonzero(mine & (has.sum(axis=0) == 1)).tolist()) for part, mine in zip(parts, has, strict=True)
    ]


def _beside_states(
    problem: FitProblem, free: WithStates, used: Sequence[int], within: Sequence[tuple[slice, list[int]]]
) -> tuple[Array, list[tuple[slice, list[int]]]]:
    """The columns of parameters and of the states of windows, and which of them are solved for within a recording:
    states too, so that they follow the values that each part asks for."""
    columns, first = [free.jacobian[:, used]], problem.core.first_rows
    own = {part.start: (part, list(mine)) for part, mine in within}
    for i, states in free.states.items():
        part, mine = own.get(first[i], (slice(first[i], first[i + 1]), []))
        begun = sum(c.shape[1] for c in columns)
        own[first[i]] = part, [*mine, *range(begun, begun + states.shape[1])]
        columns.append(states)
    return np.hstack(columns), list(own.values())


def splits(problem: FitProblem, jacobian: Array, free: WithStates | None = None) -> list[Split]:
    """The data by time (halves, thirds, quarters), by place of the markers (halves of the same weight in the Jacobian)
    and by recording. Of motions that are shot in windows, the gaps go with the window before."""
    layout, count, when = problem.rows_layout(), len(problem.experiments), problem.row_times()
    of_gaps = np.zeros(0) if free is None else free.border.copy()
    others = problem.core.rows - len(layout.frame)
    size = np.maximum(np.linalg.norm(jacobian, axis=0), np.finfo(float).tiny)
    weight = ((jacobian / size) ** 2).sum(axis=1)
    time, place = np.full(len(weight), -1.0), np.full(len(weight), -1)
    for i, (e, recording) in enumerate(zip(problem.experiments, problem.recordings, strict=True)):
        mine = layout.recording == i
        if not e.static:
            at, first = when[mine], float(when[mine].min())
            span = np.ptp(at) * (1 + 1e-9) + np.finfo(float).tiny
            time[mine] = (at - first) / span
            if free is not None:
                own = free.motion == i
                of_gaps[own] = (free.border[own] - first) / span * (1 - 1e-9)
        mine &= layout.clocks == 0  # where sensors are is no place among the markers
        marker = layout.frame[mine] if e.static else layout.channel[mine] // len(e.axes)
        along = _along(recording.positions)
        if np.isfinite(along[marker]).all() and len(set(marker.tolist())) >= FEWEST_MARKERS:
            place[mine] = _half(along[marker], weight[mine])
    made = []
    for parts, name in ((2, "half"), (3, "third"), (4, "quarter")):
        part = np.where(time < 0, -1, (parts * time).astype(int))
        order = (*ORDINALS[: parts - 1], "last")
        behind = np.append(np.full(others - len(of_gaps), -1), (parts * of_gaps).astype(int))
        made.append(Split(part, tuple(f"the {which} {name} of the time" for which in order), others=behind))
    made.append(Split(place, ("one side's markers", "the other side's markers")))
    if count > 1:
        made.append(_by_recording(problem, jacobian, free))
    return made


def _by_recording(problem: FitProblem, jacobian: Array, free: WithStates | None) -> Split:
    """Each recording, or groups of neighbors where there are too many or too short ones."""
    layout, names = problem.rows_layout(), [e.name for e in problem.experiments]
    own = {column for _, columns in _private(problem, jacobian) for column in columns}
    shared = max(jacobian.shape[1] - len(own), 1)
    most = min(len(names), MOST_RECORDINGS, MOST_COLUMNS // shared)
    for parts in range(max(most, 2), 1, -1):
        group = np.arange(len(names)) * parts // len(names)
        part = group[layout.recording]
        if np.bincount(part, minlength=parts).min() >= FEWEST * shared:
            break
    members = [np.flatnonzero(group == k) for k in range(parts)]
    called = [names[m[0]] if len(m) == 1 else f"the group of {names[m[0]]} to {names[m[-1]]}" for m in members]
    others = np.full(problem.core.rows - len(part), -1)
    if free is not None:
        others[len(others) - len(free.motion) :] = group[free.motion]
    return Split(part, tuple(called), apart=True, others=others)


def _half(order: Array, weight: Array) -> Array:
    """(rows,) bool, those that come behind the point where half of the weight has come."""
    _, index = np.unique(order, return_inverse=True)
    sums = np.cumsum(np.bincount(index, weights=weight))
    return np.asarray((sums > 0.5 * sums[-1])[index] & (index > 0))


def _along(positions: Array) -> Array:
    """(markers,) places of the markers' means along the direction in which they lie apart most."""
    mean = mean_position(positions)
    seen = np.isfinite(mean).all(axis=-1)
    centered = mean - mean[seen].mean(axis=0)
    direction = np.linalg.svd(centered[seen], full_matrices=False)[2][0]
    return np.asarray(centered @ direction)


def elsewhere(problem: FitProblem, judged: Identifiability, cost: float, others: Sequence[Elsewhere]) -> dict[str, str]:
    """By parameter, where another search ended that is far from the estimate, at a cost that is lower or as low as
    chance allows."""
    rows = problem.core.data_rows
    chance = 4 * cost / max(rows - len(problem.parameters.free), 1) * judged.autocorrelation_time
    found: dict[str, str] = {}
    for other in sorted(others, key=lambda o: o.rise):
        if other.rise > chance or cost <= 0:
            continue
        for e in judged.estimates:
            if e.verdict not in CLAIMS or e.name in found or not _outside(e, other.values[e.name]):
                continue
            lower = f"{short(-100 * other.rise / cost, 2)} % lower" if other.rise < 0 else "as low"
            value = f"{short(other.values[e.name])} {e.unit}".rstrip()
            found[e.name] = f"{other.how} ended {lower} at {value}, far outside the interval"
    return found


def _outside(e: Estimate, value: float) -> bool:
    low = -math.inf if e.lower is None else e.value - APART * (e.value - e.lower)
    high = math.inf if e.upper is None else e.value + APART * (e.upper - e.value)
    return not low <= value <= high


def held_out_motion(
    problem: FitProblem, comparisons: Sequence[Comparison], rows: Sequence[RecordingFit], interrupted: bool
) -> dict[str, str]:
    """By parameter, the recording whose held-out motion is predicted worse than by "it does not move". After Ctrl-C one
    whose start its own window would have shown counts for nothing: it starts at the mean of the others."""
    found: dict[str, str] = {}
    for c, row in zip(comparisons, rows, strict=True):
        if interrupted and c.experiment.predict == "window":
            continue
        noise = c.experiment.sigma * math.sqrt(len(c.experiment.axes)) / (c.experiment.radius or 1.0)
        if row.motion is None or row.held_out is None or not row.held_out > max(row.motion, SEEN * noise):
            continue
        error = f"{short(100 * row.held_out / row.motion)} % of the motion"
        words = f"the error on the held-out motion of {row.name} is {error}: that nothing moves is a better prediction"
        found |= {name: words for name in problem.acting_on(c.experiment) if name not in found}
    return found
