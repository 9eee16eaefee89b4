"""Whether a fit with other losses would leave much less.

What a little more loss changes is known to first order (`missing_loss`, `held_losses`). A large one changes the motion
in another way: what a little of it would damp is long gone, and what fits leave without it is large and alike over
time, so that no direction is told from chance. So fits are made with other losses: each that was given gets a third and
three times its size, and elements that have a stiffness and no damping are given one, all together and each kind by
itself (`absent_damping`). Contacts that come to rest at once are given a restitution (`absent_bounce`), and from the
best of those tried on it is fitted along. Elements that could yield and do not are given internal friction
(`absent_yield`). What two Gauss-Newton steps leave then decides: a model that is wrong in
another way leaves nearly as much with any loss. States of motions in windows take as many steps as the parameters do.

A stiffness may have grown several times to make up for the damping that is missing, as that of a cloth that is drawn
over a table does. Two steps do not lead back from there. So where nothing is found of motions with contacts, each kind
of element that has no damping is given one that is fitted along, by a search of its own.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ..arrays.types import Array
from ..errors import SheetbendError
from ..experiment.cut import in_steps
from ..experiment.experiment import Experiment
from ..minimum.optimizers import refit
from ..problem.problem import FitProblem
from ..quantities.wording import short
from ..statistics.least_squares import left_by, solved, spanned
from .absent_bounce import SIZES as BOUNCES
from .absent_bounce import has_no_bounce, with_bounce, with_free_bounce
from .absent_damping import FRAMES, undamped, with_damping, with_free_damping
from .absent_yield import HALF, PARTS, deformed, elastic_names, held_stiffness, with_free_yield, with_yield
from .directions import LEVEL, chance_of_drop, noise_in, rows_of, tied
from .held_losses import held_names, of_size
from .losses_at_zero import touches

Says = Callable[[Sequence[str], str], str]
"""What it says of the model that another loss leaves less: by names of motions, and by how much less."""
SIZES = {1 / 3: ("large", "a third"), 3.0: ("small", "three times")}  # of given losses, and what their ends are told
LEAVES = 0.2  # of the noise: a fit that leaves less beyond it lacks nothing that could be told
LESS = 0.6
"""Of what a fit leaves beyond noise: by so much less another loss must leave. It is 0.98 to 1 less where 30 ms of
damping were given as 90, and 0.63 to 1 where they were missing. It is at most 0.33 where a length, a clamp, gravity or
the kind of drag was wrong, and 0.53 where the mesh was coarse (measured)."""
LESS_BY_YIELD = 1 / 3
"""The same of internal friction: 0.46 to 0.9 where a bent sheet yields (what it leaves is the error of its substep),
and at most 0.13 where a hem, yarns, a selvage, Poisson's number or a draft was wrong (measured)."""
PROMISED = 0.1  # likewise to first order, from which on a yield is tried: 0.29 to 0.62 of yields, at most 0.002 else
SEARCHED, TOLERANCE = 30, 1e-3  # iterations at most of a search with a damping, and of its cost where it ends
STEP = 1.0  # internal: the largest step that is tried


@dataclass(frozen=True)
class _Group:
    """Motions that share parameters, their rows, and what the fit leaves in these: noise, and in all."""

    motions: list[int]
    mine: Array
    noise: float
    left: float


@dataclass(frozen=True)
class _End:
    """The end of a few steps, (free,), and the residuals (rows,) there."""

    u: Array
    r: Array


def other_losses(problem: FitProblem, u: Array) -> dict[str, str]:
    """By free parameter, a loss with which a fit of its motion would leave much less, the best of those tried.

    Takes two simulations for each loss, and a Jacobian and a third where these leave less; for a restitution two more
    Jacobians in all. For each kind of element that could yield, four simulations, and where these promise less two
    Jacobians and two simulations for each of up to three sizes and once more for the best. A loss with which the motion
    has no answer tells nothing.

    Args:
        problem: as it was fitted.
        u: (free,) the minimum.
    """
    ok, r, J = problem.evaluate(u)
    groups = _unexplained(problem, r) if ok and np.isfinite(J).all() else []
    if not groups:
        return {}
    best: dict[int, tuple[float, Says]] = {}
    stepping = problem.of([in_steps(e, 1) for e in problem.experiments])
    tried = [
        *((LESS, says, _reached(more, u, J, groups)) for more, says in _tried(stepping, u, groups)),
        *((LESS, *found) for found in _bounces(stepping, u, J, groups)),
        *((LESS_BY_YIELD, *found) for found in _yields(stepping, u, J, groups)),
    ]

    def ask(least: float, says: Says, end: _End | None, tests: int) -> None:
        after = None if end is None else end.r
        for k, group in enumerate(groups):
            if after is None or (share := _less(group, after)) <= max(least, best[k][0] if k in best else 0.0):
                continue
            drop = group.left - float(after[group.mine] @ after[group.mine])
            if chance_of_drop(problem, u, after, group.mine, drop) < LEVEL / tests:
                best[k] = share, says

    for each in tried:
        ask(*each, len(tried))
    names = _undamped(problem, groups, only=touches) if all(share <= LESS for share, _ in best.values()) else []
    for name in names:
        if sum(share > LESS for share, _ in best.values()) == len(groups):
            break
        end = _searched(with_free_damping(stepping, u, name), np.append(u, math.log(FRAMES[0])))
        ask(LESS, _lacks_damping(name), end, len(tried) + len(names))
    return {
        name: says(
            [problem.experiments[i].name for i in groups[k].motions],
            f"would leave {short(100 * min(share, 1.0), 2)} % less beyond noise",
        )
        for k, (share, says) in best.items()
        for i in groups[k].motions
        for name in problem.acting_on(problem.experiments[i])
    }


def _unexplained(problem: FitProblem, r: Array) -> list[_Group]:
    """The motions whose residuals are not noise alone."""
    layout, data = problem.rows_layout(), problem.core.data_rows
    groups = []
    for motions in tied(problem):
        mine = rows_of(problem, motions)
        noise, left = noise_in(r[:data], layout, mine[:data]), float(r[mine] @ r[mine])
        if left > (1.0 + LEAVES) * noise:
            groups.append(_Group(motions, mine, noise, left))
    return groups


def _tried(problem: FitProblem, u: Array, groups: list[_Group]) -> Iterator[tuple[FitProblem, Says]]:
    """Problems with other losses, and what it says of the model if one of them leaves less."""
    scenes = [problem.experiments[i].scene for group in groups for i in group.motions]
    for name in held_names(problem):
        if any(name in scene.quantities for scene in scenes):
            for times, (size, share) in SIZES.items():
                yield of_size(problem, name, times), _is_given(name, size, share)
    bare = _undamped(problem, groups)
    for only in (*([""] if bare else []), *(bare if len(bare) > 1 else [])):
        for frames in FRAMES:
            yield with_damping(problem, u, frames, only), _lacks_damping(only)


def _undamped(problem: FitProblem, groups: list[_Group], only: Callable[[Experiment], bool] | None = None) -> list[str]:
    """Names of what has a stiffness and no damping."""
    motions = [problem.experiments[i] for group in groups for i in group.motions]
    scenes = [e.scene for e in motions if only is None or only(e)]
    return list(dict.fromkeys(scene.groups[k].name for scene in scenes for k in undamped(scene)))


def _searched(free: FitProblem, u: Array) -> _End | None:
    """The end of a search from u (free,)."""
    try:
        end = refit(free, u, "auto", SEARCHED, TOLERANCE)
        ok, r, _ = free.evaluate(end.u, jacobian=False)
    except SheetbendError:
        return None
    return _End(end.u, r) if ok else None


def _bounces(problem: FitProblem, u: Array, J: Array, groups: list[_Group]) -> Iterator[tuple[Says, _End | None]]:
    """Restitutions, and what it says of the model if one of them leaves less."""
    if any(has_no_bounce(problem.experiments[i]) for group in groups for i in group.motions):
        sizes = ((np.array([size]), with_bounce(problem, size)) for size in BOUNCES)
        yield from _of_sizes(sizes, with_free_bounce(problem), _lacks_bounce, u, J, groups)


def _yields(problem: FitProblem, u: Array, J: Array, groups: list[_Group]) -> Iterator[tuple[Says, _End | None]]:
    """Yields of elastic elements, and what it says of the model if one of them leaves less. Those are tried which would
    leave less if the other parameters followed to first order, as without a yield."""
    q = spanned(J)
    for name in elastic_names([problem.experiments[i] for group in groups for i in group.motions]):
        if (size := deformed(problem, u, name)) > 0.0:
            sizes = [
                (np.array([HALF, np.log(part * size)]), more)
                for part in PARTS
                if _promises(more := with_yield(problem, name, part * size), u, q, groups)
            ]
            free, says = with_free_yield(problem, name, size), _lacks_yield(problem, name)
            yield from _of_sizes(sizes, free, says, u, None, groups)


def _promises(more: FitProblem, u: Array, q: Array, groups: list[_Group]) -> bool:
    """Whether residuals would be much less where parameters take up what they can to first order, q (rows, rank)."""
    ok, r, _ = more.evaluate(u, jacobian=False)
    return ok and any(_less(group, left_by(q, r)) > PROMISED for group in groups)


def _of_sizes(
    sizes: Iterable[tuple[Array, FitProblem]],
    free: FitProblem,
    says: Callable[[Array], Says],
    u: Array,
    J: Array | None,
    groups: list[_Group],
) -> Iterator[tuple[Says, _End | None]]:
    """Ends with something the model lacks, of some sizes (internal); last of the one that is fitted along, from the
    best of these on."""
    found: list[tuple[float, Array]] = []
    for size, more in sizes:
        end = _reached(more, u, J, groups)
        yield says(size), end
        if end is not None:
            found.append((float(end.r @ end.r), np.append(end.u, size)))
    if found:
        start = min(found, key=lambda each: each[0])[1]
        end = _reached(free, start, None, groups)
        yield says((start if end is None else end.u)[len(u) :]), end


def _reached(more: FitProblem, u: Array, J: Array | None, groups: list[_Group]) -> _End | None:
    """The end of two Gauss-Newton steps from u, the first with the Jacobian J of another problem if it is given. None
    where the first step leaves no less in any group, or where there is no answer."""
    try:
        ok, r, own = more.evaluate(u, jacobian=J is None)
        first = limited_step(more, u, r, own if J is None else J) if ok else u
        ok, r, _ = more.evaluate(first, jacobian=False)
        if not ok or all(_less(group, r) <= 0.0 for group in groups):
            return None
        ok, r, J = more.evaluate(first)
        if not ok or not np.isfinite(J).all():
            return None
        second = limited_step(more, first, r, J)
        ok, after, _ = more.evaluate(second, jacobian=False)
    except SheetbendError:
        return None
    return _End(second, after) if ok and float(after @ after) < float(r @ r) else _End(first, r)


def limited_step(problem: FitProblem, u: Array, r: Array, J: Array) -> Array:
    """The end of a Gauss-Newton step of limited length from u. A parameter on a logarithmic scale that grows takes the
    step of its own unit, so one that ran off toward zero comes back at once."""
    step = np.maximum(-solved(J, r), -STEP)
    log = np.array([problem.parameters[name].log for name in problem.parameters.free])
    step = np.where(log & (step > 0.0), np.log1p(np.abs(step)), np.minimum(step, STEP))
    return np.asarray(np.clip(u + step, *problem.parameters.bounds()))


def _less(group: _Group, after: Array) -> float:
    """Share of what the fit leaves beyond noise in the rows of a group that residuals `after` do not leave."""
    return (group.left - float(after[group.mine] @ after[group.mine])) / (group.left - group.noise)


def _is_given(name: str, size: str, share: str) -> Says:
    return lambda _, less: f"the given {name} is too {size}: with {share} of it the fit {less}. Free it, or measure it"


def _lacks_damping(only: str) -> Says:
    return lambda names, less: (
        f"{f'{names[0]} loses' if len(names) == 1 else 'the recordings lose'} energy that the model does not: with "
        f"damping{f' of {only}' if only else ''} the fit {less}. Give the model the loss that it lacks (such as "
        "bend_damping or membrane_damping)"
    )


def _lacks_yield(problem: FitProblem, name: str) -> Callable[[Array], Says]:
    held = held_stiffness(problem, name)
    given = f"Fit {', '.join(held)} first: too large a given value has the same effect. If the friction stays, give"
    first = given if held else "Give"
    return lambda _: (
        lambda names, less: (
            f"{names[0] if len(names) == 1 else 'the recordings'} may lose energy by friction inside {name}: with a "
            f"share of its stiffness that slides the fit {less}. {first} it a yield (such as yield_curvature and "
            "yield_share), and fit it"
        )
    )


def _lacks_bounce(restitution: Array) -> Says:
    return lambda names, less: (
        f"{f'{names[0]} bounces' if len(names) == 1 else 'the recordings bounce'} where the model comes to rest: with "
        f"a restitution of {short(float(restitution[0]), 2)} the fit {less}. Give it to the contact, and fit it"
    )
