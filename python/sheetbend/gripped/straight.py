"""The beginning of a climb: from several starts to one straight rope that is fitted to whole recordings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import product

import numpy as np

from ..errors import SheetbendError
from ..minimum.race import groups_of
from ..result.result import Start
from .descent import Descent, bearable
from .ladder import Rung
from .model import NAME, RopeModel
from .raced import raced, rows
from .search import Search
from .start import about, started
from .steps import Rope

SETTLED = 0.05  # relative change of EI at which links are short enough
FINE = 24  # links, that hold all modes of the ladder: of two numbers that agree the smaller one is taken from here on
SHORT = 12  # derivatives, at most, of a start


def straight(
    search: Search,
    models: Sequence[RopeModel],
    rung: Rung,
    bending_lengths: Sequence[float],
    most_links: int,
    count: int | None = None,
) -> tuple[Rope, tuple[Start, ...]]:
    """The first rung, from the best start that gets to its end, and the starts where they were raced.

    Args:
        count: of starts that are raced; None = those of the bending lengths, one after the other.

    Raises:
        SheetbendError: none does.
    """
    race: tuple[Start, ...] = ()
    if count is None:
        starts = _started(search, models, rung, bending_lengths)
    else:
        starts, race = _of_groups(search, models, rung, bending_lengths, count)
    for start in starts:
        try:
            return _refined(search, start, most_links), race
        except SheetbendError as error:
            search.say(f"from EI {start.values[f'{NAME}_EI']:.3g}: {error}; on to the next start")
    raise SheetbendError("no start of a straight rope gives a motion that does not diverge")


def _started(search: Search, models: Sequence[RopeModel], rung: Rung, bending_lengths: Sequence[float]) -> list[Rope]:
    """Starts fitted to short windows, best first: by the median error of predictions, then by the cost."""
    ends = []
    for model, length in product(models, bending_lengths):
        candidate = started(model, search.split.motions, length)
        own = about(rung.wanted(search.split.fitted[0]), candidate)
        found = search.descended(Rope(candidate, own, {}), search.windows[0], SHORT)
        if found is None:
            search.say(f"start at a bending length of {length:g} m: diverges")
            continue
        rope, end = found
        rope, middle = _scored(search, rope, f"start at a bending length of {length:g} m")
        ends.append((middle, end.cost, rope))
    ends.sort(key=lambda end: end[:2])
    return _of_others(search, [rope for _, _, rope in ends])


def _of_groups(
    search: Search, models: Sequence[RopeModel], rung: Rung, bending_lengths: Sequence[float], count: int
) -> tuple[list[Rope], tuple[Start, ...]]:
    """Raced starts, one for each of their groups, fitted to the longest windows: best first, as `_started`. With it the
    race in which the best one ran."""
    ends = []
    for model in models:
        firsts = [started(model, search.split.motions, length) for length in bending_lengths]
        first = Rope(firsts[0], about(rung.wanted(search.split.fitted[0]), firsts[0]), {})
        problem = search.problem(first, search.windows[0])
        if not bearable(problem, problem.cost(problem.parameters.initial())):
            problem = search.sound(problem, first.values) or problem
        ended = raced(problem, [candidate.quantities for candidate in firsts], count)
        fits, mine = dict[int, Descent](), []
        for number, group in enumerate(groups_of(ended), 1):
            values = problem.parameters.to_physical(min(group, key=lambda end: end.cost).u)
            found = _through(search, replace(first, model=first.model.at(values), values=values))
            name = f"{len(group)} of {count} starts end alike"
            if found is None:
                search.say(f"{name}: diverges on longer windows")
                continue
            fits[number] = found[1]
            rope, middle = _scored(search, found[0], name)
            mine.append((middle, found[1].cost, rope))
        lost = sum(not one.group for one in ended)
        if lost:
            search.say(f"{lost} of {count} starts failed: the motion diverges")
        ends += [(*end, rows(problem, ended, fits)) for end in mine]
    ends.sort(key=lambda end: end[:2])
    return _of_others(search, [rope for _, _, rope, _ in ends]), ends[0][-1] if ends else ()


def _through(search: Search, rope: Rope) -> tuple[Rope, Descent] | None:
    """Fitted to middle windows, then to the longest; None where most of these diverge."""
    found = search.descended(rope, search.middle)
    return None if found is None else search.descended(found[0], search.longest)


def _scored(search: Search, rope: Rope, name: str) -> tuple[Rope, float]:
    """The rope with its errors, printed under a name, and their median."""
    rope = search.judged(rope)
    EI, middle = rope.values[f"{NAME}_EI"], float(np.median(rope.errors.fitted))
    search.say(f"{name}: EI {EI:.3g}, error {1e3 * middle:.3g} mm")
    return rope, middle


def _of_others(search: Search, ropes: list[Rope]) -> list[Rope]:
    """The same, once recordings are left out that none of these ropes predicts as it does the others."""
    if ropes:
        search.leave_out(np.min([rope.errors.whole for rope in ropes], axis=0))
    return ropes


def _refined(search: Search, rope: Rope, most_links: int) -> Rope:
    """On longer windows, with the links doubled until EI moves by less than 5 %, and fitted to the longest; then once
    more without recordings that do not belong to the others.

    Raises:
        SheetbendError: the motion diverges.
    """
    for window in [*search.windows[1:-1], search.middle]:
        rope = search.fitted(rope, window)
    moved = np.inf
    while moved >= SETTLED and 2 * rope.model.segments <= most_links:
        model = replace(rope.model, segments=2 * rope.model.segments)
        finer = search.fitted(replace(rope, model=model), search.middle)
        moved = abs(finer.values[f"{NAME}_EI"] / rope.values[f"{NAME}_EI"] - 1.0)
        search.say(f"{rope.model.segments} to {finer.model.segments} links move EI by {100 * moved:.2g} %")
        if moved < SETTLED and rope.model.segments >= FINE:
            break  # the intervals count what the finer ones would move
        rope = finer
    rope = search.judged(search.fitted(rope, search.longest))
    if search.leave_out(rope.errors.whole):
        rope = search.judged(search.fitted(rope, search.longest))
    if not np.isfinite(rope.errors.typical).all():
        raise SheetbendError("most predictions diverge")
    return rope
