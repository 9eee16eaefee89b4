"""Dry friction in hinges that a model lets lose energy by viscosity alone.

A short recording shows how much energy a hinge loses, and hardly by what: a pendulum of three swings with 0.3 mN m of
dry friction was fitted with a viscosity 30 % too large, "identified" to 0.6 %, and with residuals like noise. So a
report tells what would move if 0.3 of the loss were dry friction. Where the residuals ask for some, it is named.

A hinge with dry friction may stick, so no tangent at zero tells what it changes. While the hinge slides, the torque is
proportional to it, and one simulation with a little of it does.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from ..arrays.types import Array
from ..errors import SheetbendError
from ..experiment.experiment import Experiment
from ..experiment.found_start import start_nodes
from ..motion.simulate import simulate
from ..motion.values import constraint_values
from ..objects.pivot import SLIP_ANGLE
from ..problem.problem import FitProblem
from ..quantities.wording import short
from ..scene.group import Group, GroupPlaces, places_of_groups
from ..scene.scene import Scene
from .tangents import residuals

DRY = {"hinge": "friction_hinge", "joint_angle": "joint_friction"}  # by viscous kind, that of dry friction
SHARE, TRIED = 0.3, 0.05  # of what viscosity takes: what a report tells, and what is simulated
MOST = 12  # groups of hinges, each of which takes a simulation: a chain of more is not asked
OF_IT = "of the viscous loss"


@dataclass(frozen=True)
class Dry:
    """The dry friction that a viscous hinge may have.

    Attributes:
        label: whose it is.
        column: what as much loss by dry friction as by viscosity would change of the experiment's residuals, to first
            order.
        says: words for a size of it, as a share of the viscous loss.
    """

    label: str
    column: Array
    says: Callable[[float], str]


def dry_frictions(problem: FitProblem, u: Array, i: int, corrected: Array | None) -> Iterator[Dry]:
    """Of each viscous hinge of the i-th experiment that turns and has none, at u (free,). Takes two
    simulations, and one more for each group of hinges."""
    e = problem.experiment_at(i, u)
    e = replace(e, solver=replace(e.solver, extrapolate=1))
    bare = [] if e.static else list(_bare(e.scene))
    if not 0 < len(bare) <= MOST:
        return
    values = problem.values_of(e, u)
    inputs = e.scene.compiled.inputs(e.scene.compiled.values(values))
    damping, rest = (e.scene.compiled.part(inputs, name) for name in ("damping", "rest"))
    try:
        without = residuals(problem, u, i, e, corrected)
        turned = _turned(e, problem.recordings[i].times, values)
        for places in bare:
            g = places.group
            numbers, viscosity, angle = rest[places.rest], damping[places.constraints], turned[g.name]
            steps = np.abs(np.diff(angle, axis=0))
            if not (viscosity > 0.0).all() or not (steps.sum(axis=0) > 0.0).all():
                continue
            rate = (steps**2).sum(axis=0) / steps.sum(axis=0) / np.median(np.diff(problem.recordings[i].times))
            torque = viscosity * rate  # takes as much energy
            dry = replace(e, scene=_with_friction(e.scene, g, numbers, angle[0], TRIED * torque))
            column = (residuals(problem, u, i, dry, corrected) - without) / TRIED
            yield Dry(f"dry friction in {g.name}", column, _says(g.name, float(torque[0])))
    except SheetbendError:  # a motion without an answer tells nothing
        return


def _bare(scene: Scene) -> Iterator[GroupPlaces]:
    """Groups of viscous hinges without dry friction."""
    dry = {tuple(row[:-1]) for g in scene.groups if g.kind in DRY.values() for row in g.particles.tolist()}
    for places in places_of_groups(scene.groups):
        g = places.group
        if g.kind in DRY and g.damped and not dry & set(map(tuple, _ends(g).tolist())):
            yield places


def _ends(g: Group) -> Array:
    """(hinges, nodes) of a viscous group: what turns, without the dial of a hinge between bodies."""
    return g.particles if g.kind == "hinge" else g.particles[:, :-1]


def _turned(e: Experiment, times: Array, values: dict[str, float]) -> dict[str, Array]:
    """(1 + frames, hinges) rad of each group, at the start and at each frame, without jumps by whole turns."""
    at = np.unique(np.rint(np.maximum(e.scene_times(times, values), 0.0) / e.solver.h)) * e.solver.h
    nodes = simulate(e.scene, np.unique([0.0, *at]), e.solver, values, start_nodes(e, values)).nodes
    each = [constraint_values(e.scene, x, values) for x in nodes]
    return {g.name: np.unwrap([C[g.name][:, 0] for C in each], axis=0) for g in e.scene.groups if g.kind in DRY}


def _with_friction(scene: Scene, g: Group, numbers: Array, angle: Array, torque: Array) -> Scene:
    """The scene with dry friction (hinges,) N m in the hinges of a group, which stick at an angle (hinges,) rad until
    they slide.

    Args:
        numbers: (hinges, parameters) of the group, the angle of its spring at rest last.
    """
    made, count = scene.shallow(), len(g.particles)
    made._hidden = scene._hidden.moved(*np.zeros((2, scene.hidden_count, 3)))
    at = np.zeros((count, 3))
    at[:, 0] = angle + numbers[:, -1]
    made._hidden.extend(at, np.zeros((count, 3)), np.ones(count))
    sets = np.arange(-1 - scene.hidden_count, -1 - made.hidden_count, -1)
    made.pinned = scene.pinned | set(sets.tolist())
    dry = replace(
        g,
        name=f"[dry] {g.name}",
        kind=DRY[g.kind],
        particles=np.column_stack([_ends(g), sets]),
        compliance=SLIP_ANGLE / torque,
        damping=np.zeros(count),
        damped=False,
        rest=np.column_stack([numbers[:, :-1], np.full(count, SLIP_ANGLE)]),
    )
    made.groups = [*scene.groups, dry]
    return made


def _says(name: str, torque: float) -> Callable[[float], str]:
    return lambda share: f"{name} had a dry friction of {short(1e3 * share * torque, 2)} mN m, which the model lacks"
