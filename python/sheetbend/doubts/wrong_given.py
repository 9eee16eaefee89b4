"""Whether a number that a fit takes as given is wrong, or the model lacks a part: gravity, lengths, densities, clamps,
places of markers, clocks; drag, masses, stretch.

An error of such a number moves the minimum, and what it cannot move away stays in the residuals, along the derivative
with respect to that number beside those of the parameters. Where that direction explains nearly all that the fit leaves
beyond noise, and more than chance does, the number is named with what it would have to be (a score test; Rao 1948,
Mathematical Proceedings of the Cambridge Philosophical Society 44, 50). Where two together explain nearly all and leave
a third of what one alone leaves, the two are named. Parameters are doubtful that would then move out of their
intervals. Where much is left and no number explains nearly all of it, as where contacts begin and end at other times
than to first order, those that explain a third make parameters doubtful which they would move so. Numbers that trade
with the parameters exactly, as a density does with a stiffness, leave nothing behind: what these move is among what the
result rests on (`given.premises`).
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cache, partial

import numpy as np

from ..arrays.types import Array
from ..minimum.discretization import Refinement
from ..problem.lifted import Lifted
from ..problem.problem import FitProblem
from ..quantities.wording import short
from ..result.estimate import UNSOUND
from ..statistics.gauge import RANK_TOLERANCE
from ..statistics.identifiability import Identifiability
from ..statistics.intervals import reach_of
from ..statistics.least_squares import left_by
from .causes import MOST, Cause, Wrong, beyond_chance, causes, of_noise, of_what_is_left, seen_beside
from .contradictions import residual_shifts, value_words
from .directions import EXPLAINS, noise_in, rows_of, tied, with_changes
from .driven_errors import FEW, driven_errors, driven_span
from .followed import followed
from .held_losses import held_names
from .lacking import Lacking
from .losses_at_zero import is_loss
from .losses_beside_contacts import lost_beside_contacts
from .lost_frames import lost_frames
from .told import ASIDE, LARGER, LATER, SLOWER, Told, told_numbers
from .told_inputs import FARTHER
from .told_words import words_of
from .unbroken import unbroken, unbroken_refinement

MUCH = 2.0
"""Times the noise, and the told sigma's where that is more: what a fit that misses much leaves beyond it. Residuals are
1.7 sigma then, or more."""
FELT = 0.05
"""Of the sum of squares that sigma allows, which is the number of residuals: a fit that leaves less beyond noise is not
asked for what its model lacks. A knot of 1.3 g at the end of a rope that is drawn over a table leaves 0.13 to 0.2, and
made the friction 65 % too large (measured)."""
OWN = (LATER, SLOWER, LARGER, FARTHER, ASIDE)  # errors that each recording has of its own
FAR = 9.0
"""Times the noise, what is left beyond it: residuals are more than three times the noise. Where nothing explains that,
what explains a third of it is told. Where one parameter is doubtful for it, so are the others of its motion, since what
is at work there is not known."""
LONGEST = 5e7  # rows times directions: above, markers are asked only all together


def wrong_given(
    problem: FitProblem, u: Array, told: Sequence[Told], refinement: Refinement | None = None
) -> list[Wrong]:
    """What residuals ask of the told numbers, and of what the model lacks: some sets of tangents of motions whose
    residuals are more than noise.

    Args:
        u: (free,) the minimum.
        told: `told_numbers` there.
        refinement: of the discretization; where a number is to be named, one simulation each tells what a shorter
            substep and a finer mesh explain, and that counts first.

    Noise of what drives a scene hides a wrong number. So where much is left of a motion and no number explains nearly
    all of it, they are asked for what no other driven motion explains (`driven_span`).
    """
    ok, r, J = problem.evaluate_exactly(u)
    if not ok or not np.isfinite(J).all():
        return []
    inside, lacking = problem.parameters.inside(u), Lacking(problem, u)
    # A parameter at a limit cannot absorb residuals beyond it, but it can move back from it. So both are asked.
    ways = [J] if inside.all() else [inside * J, J]
    shifts = cache(lambda: residual_shifts(problem, u, refinement) if refinement is not None else [])

    def asked(driven: Array | None = None) -> list[Wrong]:
        for way in ways:
            found = _asked(problem, u, r, way, told, lacking, driven=driven)
            if found and shifts():
                found = _asked(problem, u, r, way, told, lacking, np.column_stack(shifts()), driven)
            if found:
                return found
        return []

    found = [one if one.sure or one.times <= FAR else followed(problem, u, one) for one in asked()]
    if problem.estimates_corrections:
        return found
    sure = {one.motions for one in found if one.sure}
    if _much_left(problem, u, sure) and (driven := driven_span(problem, u)).size:
        found = _surer(found, asked(driven))
    return _surer(found, _lost(problem, u, told, lacking, found, refinement))


def _of_unbroken(problem: FitProblem, u: Array, refinement: Refinement | None) -> list[Wrong]:
    """What explains nearly all that unbroken motions leave. Gaps may take up what nothing explains: they are there for
    it."""
    if (found := unbroken(problem, u)) is None:
        return []
    refinement = None if refinement is None else unbroken_refinement(refinement)
    sure = [one for one in wrong_given(*found, told_numbers(*found)[0], refinement) if one.sure]
    return [replace(one, steps=tuple(found[1] - u + s for s in one.steps), unbroken=True) for one in sure]


def _surer(found: Sequence[Wrong], others: Sequence[Wrong]) -> list[Wrong]:
    """What was found, and of motions of which nothing explains nearly all what does among others."""
    by = {one.motions: one for one in found}
    by |= {one.motions: one for one in others if one.sure and not (one.motions in by and by[one.motions].sure)}
    return list(by.values())


def wrong_in_either(
    at: tuple[FitProblem, Array],
    fitted: tuple[FitProblem, Array],
    told: Sequence[Told],
    refinement: Refinement | None = None,
) -> list[Wrong]:
    """`wrong_given` in the limit of short substeps, and as it was fitted for motions of which much is left and no
    number is named there: a limit that takes differences of two runs has tangents that contacts spoil first. Of motions
    that were shot in windows, their unbroken ones are asked (`unbroken`).

    Args:
        at: the problem and its minimum in that limit.
        fitted: both before.
        told: `told_numbers` in the limit.
    """
    if isinstance(at[0].core, Lifted):
        return _of_unbroken(*at, refinement)
    found = wrong_given(*at, told, refinement)
    sure = {one.motions for one in found if one.sure}
    if at[0] is fitted[0] or (len(sure) == len(found) and not _much_left(*at, sure)):
        return found
    return _surer(found, wrong_given(*fitted, told_numbers(*fitted)[0], refinement))


def _much_left(problem: FitProblem, u: Array, but: set[tuple[int, ...]]) -> bool:
    """Whether a fit misses much of some motions but those."""
    ok, r, _ = problem.evaluate(u, jacobian=False)
    rows = [rows_of(problem, group) for group in tied(problem, still=True) if tuple(group) not in but]
    return ok and any(float(r[mine] @ r[mine]) > (1.0 + MUCH) * np.count_nonzero(mine) for mine in rows)


def _asked(
    problem: FitProblem,
    u: Array,
    r: Array,
    J: Array,
    told: Sequence[Told],
    lacking: Lacking,
    known: Array | None = None,
    driven: Array | None = None,
) -> list[Wrong]:
    """The same, with known errors of the residuals (rows, errors) of any size taken out, and changes of what drives the
    scenes (rows, changes). These may have moved the parameters, too."""
    layout, data, count = problem.rows_layout(), problem.core.data_rows, J.shape[1]
    taken = problem.absorbed
    for more in (known, driven):
        if more is not None:
            J = with_changes(J, more)
    size = np.linalg.norm(J, axis=0)
    scale = np.where(size > 0.0, size, 1.0)
    q, sizes, right = np.linalg.svd(J / scale, full_matrices=False)
    kept = sizes > RANK_TOLERANCE * sizes.max(initial=0.0)
    q, inverse = q[:, kept], right[kept].T / sizes[kept] / scale[:, None]
    there = np.zeros(count) if driven is None else (-inverse @ (q.T @ r))[:count]
    r = left_by(q, r)
    errors = cache(partial(driven_errors, problem, u, FEW))
    found, groups = [], tied(problem, still=True)

    def likely(tried: Sequence[tuple[Told, Array]], mine: Array, left: float, least: float) -> list[Cause]:
        white = max((float(r[mine] @ r[mine]) - left) / np.count_nonzero(mine), 1.0)
        chance = partial(of_what_is_left, r, J, mine, layout, taken) if least == MOST else partial(of_noise, q, white)
        seen = seen_beside(q, tried)
        for two in (True, False) if least == MOST else (False,):  # where chance explains a second one, one may do
            explaining = causes(r, seen, left, least, two)
            tests = [math.comb(len(tried), len(cause.parts)) * len(groups) for cause in explaining]
            each = zip(explaining, tests, strict=True)
            if sure := [cause for cause, n in each if beyond_chance(partial(chance, cause), n, errors)]:
                return sure
        return []

    for group in groups:
        mine = rows_of(problem, group)
        left = float(r[mine] @ r[mine]) - noise_in(r[:data], layout, mine[:data])
        if not left > 0.0:
            continue
        rows = float(np.count_nonzero(mine))
        much, allowed = left > FELT * rows, max(float(r[mine] @ r[mine]) - left, rows)
        without_number = [*lacking.of(group), *lost_frames(problem, q, r, told)] if much else []
        tried = list(_directions(problem, [*told, *without_number], group))
        asked, sure = likely(tried, mine, left, MOST), True
        if asked and not much and (parts := lacking.beside_contacts(group)):
            asked = likely([*tried, *_directions(problem, parts, group)], mine, left, MOST) or asked
        if not asked and left > MUCH * allowed:
            asked, sure = likely(tried, mine, left, EXPLAINS), False
        if asked:
            words = tuple(" and ".join(words_of(one, more, problem, group) for one, more, _ in c.parts) for c in asked)
            moved = [np.sum([more * column for _, more, column in c.parts], axis=0) for c in asked]
            steps = tuple(there + (-inverse @ (q.T @ by))[:count] for by in moved)
            share, beside = asked[0].explained, driven is not None
            causes_left = () if sure else tuple(asked)
            found.append(Wrong(tuple(group), words, steps, share, left / allowed, sure, beside, causes=causes_left))
    return found


def _lost(
    problem: FitProblem,
    u: Array,
    told: Sequence[Told],
    lacking: Lacking,
    found: Sequence[Wrong],
    refinement: Refinement | None,
) -> list[Wrong]:
    """Losses that motions with contacts ask for, of which nothing else explains nearly all that is left."""
    known, held = {one.motions for one in found if one.sure}, held_names(problem)
    groups = [g for g in tied(problem) if lacking.beside_contacts(g)]
    lost = []
    for group in groups:
        if tuple(group) not in known:
            tried = _directions(problem, [*told, *lacking.beside_contacts(group)], group, held)
            losses = [
                (one, by) for one, by in tried if is_loss(one.label) or (one.missing is None and one.name in held)
            ]
            lost.append(lost_beside_contacts(problem, u, group, losses, len(groups), refinement))
    return [one for one in lost if one is not None]


def _directions(
    problem: FitProblem, told: Sequence[Told], group: Sequence[int], losses: Sequence[str] = ()
) -> Iterator[tuple[Told, Array]]:
    """The errors that motions may share, or that one of them may have: (rows,) what each changes. Of given losses only
    some."""
    rows, first, others = problem.core.rows, problem.core.first_rows, set(held_names(problem)) - set(losses)
    others |= {"marker_mass"}  # which is asked among what the model lacks
    if any(one.name == "gravity" for one in told):
        others |= {"draft"}  # which pushes like a gravity that is turned
    within = [one for one in told if one.experiment in group and one.name not in others]
    apart = len(within) * rows <= LONGEST
    motions = Counter(label for label, _ in {(one.label, one.experiment) for one in within})
    each: dict[str, tuple[Told, Array]] = {}
    for one in within:
        own = one.name in ("clamps", "clamp_direction") or one.label.startswith(OWN) or bool(one.marker)
        label = f"{one.label} {one.experiment}" if own else one.label
        labels = [(label, replace(one, shared=not own and motions[one.label] > 1))]
        if one.marker:
            together = f"all {one.experiment} {one.label.rsplit(' ', 1)[-1]}", replace(one, marker="")
            labels = [*labels[: int(apart)], together]
        for label, of in labels:
            _, column = each.setdefault(label, (of, np.zeros(rows)))
            column[first[one.experiment] : first[one.experiment + 1]][one.rows] += one.column
    solved = problem.estimates_corrections  # what is solved for on the way takes up a part of each error
    yield from (
        (one, problem.core.reduced(by[: problem.core.data_rows]) if solved else by) for one, by in each.values()
    )


def doubts_of(problem: FitProblem, u: Array, judged: Identifiability, wrong: Sequence[Wrong]) -> dict[str, str]:
    """By free parameter that a wrong number would move out of its interval, why it is doubtful."""
    estimates, found = {e.name: e for e in judged.estimates}, dict[str, str]()
    for one in wrong:
        moved: dict[str, str] = {}
        for k, name in enumerate(problem.parameters.free):
            p, e = problem.parameters[name], estimates[name]
            reach = reach_of(p, e)
            step, words = max(
                ((float(s[k]), w) for s, w in zip(one.steps, one.words, strict=True)), key=lambda m: abs(m[0])
            )
            if e.verdict not in UNSOUND and abs(step) > reach:
                which = "With that" if len(one.words) == 1 else f"If {words},"
                there = value_words(p, u[k], step, reach)
                cause = _sentence(problem, one) if one.sure else _unsure(problem, one)
                order = "fitted along" if one.fitted else "to first order"
                moved[name] = f"{cause}. {which} it would be {there} ({order})"
        if moved and not one.sure and one.times > FAR:
            others = {name for i in one.motions for name in problem.acting_on(problem.experiments[i])} - set(moved)
            why = f"{_unsure(problem, one)}. That makes {', '.join(moved)} doubtful, and its effect here is not known"
            moved |= {name: why for name in problem.parameters.free if name in others}
        found |= {name: why for name, why in moved.items() if estimates[name].verdict not in UNSOUND}
    return found


def warnings_of(problem: FitProblem, wrong: Sequence[Wrong]) -> tuple[str, ...]:
    """The wrong numbers that explain nearly all, and where very much is left those that explain a part of it."""
    told = [(_sentence if one.sure else _unsure)(problem, one) for one in wrong if one.sure or one.times > FAR]
    return tuple(f"{words}. Check that, and correct the model or the recording" for words in told)


def explained_by(problem: FitProblem, wrong: Sequence[Wrong]) -> dict[str, float]:
    """By free parameter, the share of what its motions leave beyond noise that a wrong number explains."""
    return {
        name: one.explained
        for one in wrong
        if one.sure
        for i in one.motions
        for name in problem.acting_on(problem.experiments[i])
    }


def _whose(problem: FitProblem, wrong: Wrong) -> str:
    names = [problem.experiments[i].name for i in wrong.motions]
    return names[0] if len(names) == 1 else "the recordings"


def _unsure(problem: FitProblem, wrong: Wrong) -> str:
    part, size = short(100 * wrong.explained, 2), short(math.sqrt(1.0 + wrong.times), 2)
    return (
        f"residuals are {size} times the noise of {_whose(problem, wrong)}, and no single error explains nearly all of "
        f"that. {part} % of it looks as if {', or '.join(wrong.words)}"
    )


def _sentence(problem: FitProblem, wrong: Wrong) -> str:
    whose = _whose(problem, wrong)
    part = short(100 * min(wrong.explained, 1.0), 2)
    noise = "noise, that of what drives it included," if wrong.driven else "noise"
    fit = "a fit without `shooting`" if wrong.unbroken else "the fit"
    return f"{part} % of what {fit} leaves of {whose} beyond {noise} looks as if {', or '.join(wrong.words)}"
