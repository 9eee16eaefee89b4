"""Whether a number that a fit takes as given is wrong, or the model lacks a part: gravity, lengths, densities, clamps,
places of markers, clocks; drag, masses, stretch.

An error of such a number moves the minimum, and what it cannot move away stays in the residuals, along the derivative
with respect to that number beside those of the parameters. Where that direction explains nearly all that the fit leaves
beyond noise, and more than chance does, the number is named with what it would have to be (a score test; Rao 1948,
Mathematical Proceedings of the Cambridge Philosophical Society 44, 50). Parameters are doubtful that would then move
out of their intervals. Numbers that trade with the parameters exactly, as a density does with a stiffness, leave
nothing behind: what these move is among what the result rests on (`given.premises`).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..arrays.timeseries import Array
from ..minimum.discretization import Refinement
from ..minimum.problem import FitProblem
from ..quantities.wording import short
from ..result.result import UNSOUND
from ..statistics.gauge import RANK_TOLERANCE
from ..statistics.identifiability import Identifiability
from ..statistics.intervals import reach_of
from .cloth_size import cloth_sizes
from .contradictions import residual_shifts, value_words
from .directions import LEVEL, asked_for, noise_in, rows_of, tied
from .driven_errors import FEW, driven_errors
from .held_losses import held_names
from .missing_parts import missing_parts
from .other_losses import LEAVES
from .told import DEGREE, LARGER, LATER, MILLIMETER, SIZE, SLOWER, Told

NEARLY_ALL = 0.9
"""Of what a fit leaves beyond noise: the part that an error must explain. The one that was made explains 0.88 to 1.1 on
small ropes (gravity, lengths, clamps, places, clocks, drag, masses, stretch). Others explain at most 0.83, but for
those that look the same, such as the size of gravity and a clock; a mesh four times finer at most 0.28 (measured)."""
ALIKE = 0.05  # by so much less explained, another number is named beside
MOST_NAMED = 3
FARTHEST = {"rad": 0.3, "m": 0.1, "s": 0.1, "": 0.7}
"""Largest errors that are told, by unit; "" for relative ones. First order says nothing of larger ones."""
LONGEST = 5e7  # rows times directions: above, markers are asked only all together


@dataclass(frozen=True)
class Wrong:
    """What motions that share parameters ask of a told number.

    Attributes:
        motions: places of their experiments.
        words: by how much a number is off, the likeliest first where several explain about as much.
        steps: (free,) of each, internal, what the parameters would move with that number as asked for.
        explained: share of what the fit leaves beyond noise.
    """

    motions: tuple[int, ...]
    words: tuple[str, ...]
    steps: tuple[Array, ...]
    explained: float


def wrong_given(
    problem: FitProblem, u: Array, told: Sequence[Told], refinement: Refinement | None = None
) -> list[Wrong]:
    """What residuals ask of the told numbers, and of what the model lacks: two sets of tangents of motions whose
    residuals are more than noise.

    Args:
        u: (free,) the minimum.
        told: `told_numbers` there.
        refinement: of the discretization; where a number is to be named, one simulation each tells what a shorter
            substep and a finer mesh explain, and that counts first.
    """
    ok, r, J = problem.evaluate(u)
    if not ok or not np.isfinite(J).all() or problem.estimates_corrections:
        return []
    found = _asked(problem, u, r, J, told)
    if found and refinement is not None and (shifts := residual_shifts(problem, u, refinement)):
        found = _asked(problem, u, r, J, told, np.column_stack(shifts))
    return found


def _asked(
    problem: FitProblem, u: Array, r: Array, J: Array, told: Sequence[Told], known: Array | None = None
) -> list[Wrong]:
    """The same, with known errors of the residuals (rows, errors) of any size taken out."""
    layout, data, count = problem.rows_layout(), problem.core.data_rows, J.shape[1]
    if known is not None:
        J = np.hstack([J, np.vstack([known, np.zeros((len(r) - data, known.shape[1]))])])
    scale = np.maximum(np.linalg.norm(J, axis=0), np.finfo(float).tiny)
    q, sizes, right = np.linalg.svd(J / scale, full_matrices=False)
    kept = sizes > RANK_TOLERANCE * sizes.max(initial=0.0)
    q, inverse = q[:, kept], right[kept].T / sizes[kept] / scale[:, None]
    r = r - q @ (q.T @ r)
    found = []
    groups = tied(problem, still=True)
    for group in groups:
        mine = rows_of(problem, group)
        left = float(r[mine] @ r[mine]) - noise_in(r[:data], layout, mine[:data])
        if not left > 0.0:
            continue
        moving = [i for i in group if not problem.experiments[i].static]
        lacking = [part for i in moving for part in _lacking(problem, u, i)] if left > LEAVES * data else []
        tried = list(_directions(problem, [*told, *lacking], group))
        asked = []
        for one, column in tried:
            beside = column - q @ (q.T @ column)
            inner, along = float(beside @ beside), float(beside @ r)
            seen = inner > RANK_TOLERANCE * float(column @ column)
            if seen and along**2 > NEARLY_ALL * inner * left and _possible(one, -along / inner):
                asked.append((along**2 / inner / left, -along / inner, one, column))
        asked.sort(key=lambda each: -each[0])
        asked = [each for each in asked if each[0] > asked[0][0] - ALIKE][:MOST_NAMED]
        errors = driven_errors(problem, u, FEW) if asked else np.zeros((0, 0))
        sure = []
        for each in asked:
            answer = asked_for(r, J, each[3], mine, layout, errors=errors if errors.size else None)
            if answer is not None and answer.chance < LEVEL / (len(tried) * len(groups)):
                sure.append(each)
        if sure:
            words = tuple(_off(one, more, problem, group) for _, more, one, _ in sure)
            steps = tuple((-inverse @ (q.T @ (more * column)))[:count] for _, more, _, column in sure)
            found.append(Wrong(tuple(group), words, steps, sure[0][0]))
    return found


def _lacking(problem: FitProblem, u: Array, i: int) -> list[Told]:
    """Directions of what no number of the model tells."""
    return [*missing_parts(problem, u, i), *cloth_sizes(problem, u, i)]


def _possible(one: Told, more: float) -> bool:
    """Whether an error of this size can be: small enough for first order, and of what is missing no less than none."""
    if one.missing is not None and not one.unit:
        return more > 0.0 or one.signed
    return abs(more) < FARTHEST.get("" if one.relative else one.unit, np.inf)


def doubts_of(problem: FitProblem, u: Array, judged: Identifiability, wrong: Sequence[Wrong]) -> dict[str, str]:
    """By free parameter that a wrong number would move out of its interval, why it is doubtful."""
    estimates, found = {e.name: e for e in judged.estimates}, {}
    for one in wrong:
        for k, name in enumerate(problem.parameters.free):
            p, e = problem.parameters[name], estimates[name]
            reach = reach_of(p, e)
            step, words = max(
                ((float(s[k]), w) for s, w in zip(one.steps, one.words, strict=True)), key=lambda m: abs(m[0])
            )
            if e.verdict not in UNSOUND and abs(step) > reach:
                which = "With that" if len(one.words) == 1 else f"If {words},"
                there = value_words(p, u[k], step, reach)
                found[name] = f"{_sentence(problem, one)}. {which} it would be {there} (to first order)"
    return found


def warnings_of(problem: FitProblem, wrong: Sequence[Wrong]) -> tuple[str, ...]:
    """The wrong numbers."""
    return tuple(f"{_sentence(problem, one)}. Check that, and mend the model or the recording" for one in wrong)


def explained_by(problem: FitProblem, wrong: Sequence[Wrong]) -> dict[str, float]:
    """By free parameter, the share of what its motions leave beyond noise that a wrong number explains."""
    return {
        name: one.explained for one in wrong for i in one.motions for name in problem.acting_on(problem.experiments[i])
    }


def _directions(problem: FitProblem, told: Sequence[Told], group: Sequence[int]) -> Iterator[tuple[Told, Array]]:
    """The errors that motions may share, or that one of them may have: (rows,) what each changes."""
    rows, first, losses = problem.core.rows, problem.core.first_rows, set(held_names(problem))
    within = [one for one in told if one.experiment in group and one.name not in losses]
    apart = len(within) * rows <= LONGEST
    each: dict[str, tuple[Told, Array]] = {}
    for one in within:
        own = one.name in ("clamps", "clamp_direction") or one.label in (LATER, SLOWER, LARGER)
        labels = [(f"{one.label} {one.experiment}" if own or one.marker else one.label, one)]
        if one.marker:
            together = f"all {one.experiment} {one.label.rsplit(' ', 1)[-1]}", replace(one, marker="")
            labels = [*labels[: int(apart)], together]
        for label, of in labels:
            _, column = each.setdefault(label, (of, np.zeros(rows)))
            column[first[one.experiment] : first[one.experiment + 1]][one.rows] += one.column
    yield from each.values()


def _sentence(problem: FitProblem, wrong: Wrong) -> str:
    names = [problem.experiments[i].name for i in wrong.motions]
    whose = names[0] if len(names) == 1 else "the recordings"
    part = short(100 * min(wrong.explained, 1.0), 2)
    return f"{part} % of what the fit leaves of {whose} beyond noise is as if {', or '.join(wrong.words)}"


def _off(one: Told, more: float, problem: FitProblem, group: Sequence[int]) -> str:
    """That a told number is off by `more`, in words."""
    if one.missing is not None:
        return one.missing(more)
    e = problem.experiments[one.experiment]
    of = f" of {e.name}" if len(group) > 1 else ""
    size = short(abs(100 * more), 2) + " %"
    sign = "more" if more > 0 else "less"
    axis = f"{'' if more > 0 else '-'}{one.label.rsplit(' ', 1)[-1]}"
    if one.label == SIZE:
        return f"gravity were {size} {'larger' if more > 0 else 'smaller'}"
    if one.label == LATER and e.scene.boundary.driven:
        when = f"{short(1e3 * abs(more), 2)} ms {'early' if more > 0 else 'late'}"
        return f"the clock of the recording{of} were {when} against that of what drives the scene (time_offset)"
    if one.label == LATER:
        when = "earlier" if more > 0 else "later"
        return f"the motion{of} had begun {short(1e3 * abs(more), 2)} ms {when} than the scene does (start_time)"
    if one.label == SLOWER:
        return f"the times of the recording{of} were {size} too {'short' if more > 0 else 'long'} (its frame rate)"
    if one.label == LARGER:
        return f"the recording{of} were {size} too {'small' if more < 0 else 'large'} (its scale)"
    if one.name == "gravity":
        return f"gravity were turned by {short(abs(more) / DEGREE, 2)} degrees {_way(one.label, more)}"
    if one.name == "clamp_direction":
        return f"the clamps{of} and all with them were turned by {short(abs(more) / DEGREE, 2)} degrees about {axis}"
    if one.name == "clamps":
        return f"the clamps{of} and all with them stood {short(abs(more) / MILLIMETER, 2)} mm farther along {axis}"
    if one.name == "markers":
        who = f"marker {one.marker}" if one.marker else "all markers"
        along = f"axis {1 + int(one.label.rsplit(' ', 1)[-1])} of the cloth" if e.scene.cloths else "the material"
        how = "farther" if more > 0 else "less far"
        return f"{who}{of} sat {short(abs(more) / MILLIMETER, 2)} mm {how} along {along}"
    if one.relative:
        return f"{one.name} were {size} {sign}"
    return f"{one.name} were {short(abs(more), 2)} {one.unit} {sign}"


def _way(label: str, more: float) -> str:
    """Such as "toward -x"."""
    way = label.removeprefix("gravity ")
    return way if more > 0 else way.replace("toward ", "toward -")
