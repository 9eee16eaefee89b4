"""A gradient check that users can run on their own scene: the adjoint against independent paths.

Each path is judged down to its own noise. Complex step and adjoint agree to 1e-8, or to what rounding leaves of them:
how far the adjoint itself moves when the last digits of the inputs do. Differences agree to 1e-4, or to their own
error, which the change from one step to half of it tells.
"""

from __future__ import annotations

import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..arrays.checks import MOST_WHOLE, check_count, is_number
from ..errors import InputError
from ..scene.compiled import CompiledScene
from ..scene.domain import NOT_NEGATIVE, POSITIVE
from ..scene.scene import Scene
from .core_terms import compiled_of, divergence, substeps
from .gradient_probe import DIFFERENCES_BOUND, JITTERS, LOUD, Probe, jittered
from .gradient_report import COMPLEX_STEP_BOUND, GradientReport, GradientRow
from .solver import Solver
from .tape import budget

RUNS = 6.0  # of the scene for differences along one direction, mostly
SHORTER = (1.0, 0.5, 0.25, 0.125)
SIZED = (*NOT_NEGATIVE, *POSITIVE)  # arrays whose steps are judged against their own entries, however small these are


def check_gradients(
    scene: Scene,
    times: ArrayLike,
    solver: Solver | None = None,
    samples: int = 6,
    seed: int = 0,
    values: Mapping[str, float] | None = None,
    seconds: float | None = None,
) -> GradientReport:
    """Check the adjoint of a scene's rollout for every named quantity and every input array.

    Examples:
        >>> rope = sb.rope(0.6, 8, density=0.05, EI=1e-3)
        >>> sb.check_gradients(rope, [0.05], sb.Solver(h=1 / 480)).passed
        True

    The loss is a random linear combination of all positions at `times`. Arrays with more than `samples` entries are
    tested on the largest gradient entries and on random ones. Compliances of rigid constraints that follow from one
    another are not tested: the motion has no derivative with respect to them.

    Args:
        scene: frozen by this call.
        times: (frames,) s on the substep grid; a short stretch of motion is enough.
        solver: `Solver()` by default.
        samples: entries of each array that are tested, at most.
        seed: of the random loss and of the random entries.
        values: quantities to change, by name, in their units.
        seconds: s, about how long the check may take. A scene that takes longer is checked on fewer entries, or along
            one direction of all entries of an array, and over fewer substeps; the report states this.

    Raises:
        InputError, DivergenceError: as `simulate`; times without a substep, or fewer than one sample.
    """
    solver, compiled = Solver.given(solver), compiled_of(scene)
    steps = substeps(times, solver.h)
    if steps[-1] == 0:
        raise InputError("times", "hold no substep to check", times, f"give frames up to {4 * solver.h:g} s or later")
    check_count("samples", samples, 1, MOST_WHOLE, InputError)
    check_count("seed", seed, 0, MOST_WHOLE, InputError)
    if seconds is not None and not (is_number(seconds) and seconds > 0):
        raise InputError("seconds", "must be positive", seconds, "give s, or leave it out")
    core = solver.core(compiled)
    theta = compiled.values(values)
    inputs = compiled.inputs(theta)
    sampled = ""
    with divergence(scene), budget(solver):
        if seconds is not None:
            steps, samples, sampled = _within(seconds, compiled, core, inputs, steps, samples)
        rng = np.random.default_rng(seed)
        _, tape = core.record(inputs, steps, 0.0, solver.budget)
        weights = rng.standard_normal((len(steps), compiled.core.dofs))
        adjoint = core.vjp(inputs, tape, steps, weights, 0.0)
        probe = Probe(core, inputs, steps, weights, adjoint)
        jitter = _jitter(probe, adjoint, solver, np.random.default_rng(seed + 1))
        checked = _Checked(compiled, probe, adjoint, jitter, _without_derivative(compiled, core, inputs))
        rows = [checked.quantity(theta, name, scene.quantities[name].positive) for name in compiled.names]
        rows += [checked.array(name, samples, rng) for name in _present(compiled)]
        dot = checked.dot_product(rng)
    return GradientReport(scene.name, steps[-1], tuple(rows), dot, sampled)


def _jitter(probe: Probe, adjoint: np.ndarray, solver: Solver, rng: np.random.Generator) -> np.ndarray:
    """(JITTERS, inputs) by how much the adjoint moves when the last digits of the inputs do."""
    core, steps, moved = probe.core, probe.steps, []
    for _ in range(JITTERS):
        x = jittered(probe.inputs, rng)
        moved.append(core.vjp(x, core.record(x, steps, 0.0, solver.budget)[1], steps, probe.weights, 0.0) - adjoint)
    return np.array(moved)


def _without_derivative(compiled: CompiledScene, core: Any, inputs: np.ndarray) -> dict[str, np.ndarray]:
    """By input array, the entries that the motion has no derivative with respect to: compliances of rigid constraints
    that follow from one another. One of them that gives way leaves its part to another, which was left out before."""
    _, count = compiled.layout["compliance"]
    found = np.array(core.redundant_constraints(inputs, 0.0), dtype=int)
    of_constraints, of_volumes = found[found < count], found[found >= count] - count
    entries = {"compliance": of_constraints, "volume_compliance": of_volumes}
    return {name: own[inputs[compiled.layout[name][0] + own] == 0.0] for name, own in entries.items()}


def _within(
    seconds: float, compiled: CompiledScene, core: Any, inputs: np.ndarray, steps: list[int], samples: int
) -> tuple[list[int], int, str]:
    """Substeps and samples (0: all entries of an array at once) whose check takes about so long, and what that leaves
    out, in words."""
    began = time.perf_counter()
    core.complex_step(inputs, np.zeros(len(inputs)), [1], 0.0)
    between = time.perf_counter()
    core.simulate(inputs, [1], 0.0)
    once = (between - began) + RUNS * (time.perf_counter() - between)  # of one direction and substep
    quantities, arrays = len(compiled.names), len(_present(compiled))
    for share in SHORTER:
        chosen = sorted({math.ceil(share * step) for step in steps})
        left = seconds / (once * chosen[-1]) - quantities
        if left >= arrays or share == SHORTER[-1]:
            break
    possible = max(0, int(left / arrays))
    possible = samples if possible >= samples else possible if possible > 1 else 0
    words = [] if chosen == steps else [f"over {chosen[-1]} of {steps[-1]} substeps"]
    if possible < samples:
        words.append(f"{possible or 'all'} entries of an array {'each' if possible else 'along one direction'}")
    return chosen, possible, f"sampled to take about {seconds:.0f} s: {', '.join(words)}" if words else ""


@dataclass(frozen=True)
class _Entry:
    """One tested derivative: by the adjoint, by complex step, by differences with their error, what it may be without
    being felt, and what rounding moves in the adjoint."""

    gradient: float
    exact: float
    rough: float
    error: float
    faint: float
    rounding: float


@dataclass(frozen=True)
class _Checked:
    """An adjoint beside the paths that it is checked against.

    Attributes:
        probe: the two independent paths.
        adjoint: (inputs,) the gradient that is checked.
        jitter: (JITTERS, inputs) by how much it moves when the last digits of the inputs do.
        left_out: by input array, the entries without a derivative.
    """

    compiled: CompiledScene
    probe: Probe
    adjoint: np.ndarray
    jitter: np.ndarray
    left_out: Mapping[str, np.ndarray]

    def quantity(self, theta: np.ndarray, name: str, positive: bool) -> GradientRow:
        """The row of a named quantity, at the values theta."""
        probe, direction = self.probe, np.zeros(len(theta))
        direction[self.compiled.names.index(name)] = 1.0
        gradient = float(self.compiled.theta_bar(theta, self.adjoint) @ direction)
        along = self.compiled.inputs_dot(theta, direction)
        exact = probe.complex_step(along)
        size = probe.size(float(theta @ direction), 1e-2, positive, exact)
        moved = self._rounding(along, self.jitter @ along, gradient, exact, abs(gradient))
        found = probe.differences(along, 1e-4 * size, exact)
        return _row(name, 1, [_Entry(gradient, exact, *found, probe.rounding / size, moved)])

    def array(self, name: str, samples: int, rng: np.random.Generator) -> GradientRow:
        """The row of an input array: the largest entries of its gradient and random ones, or all entries at once where
        there are no samples."""
        probe = self.probe
        offset, size = self.compiled.layout[name]
        left_out = self.left_out.get(name, np.zeros(0, dtype=int))
        tested = np.delete(np.arange(offset, offset + size), left_out)
        if len(tested) == 0:
            return GradientRow(name, size, 0.0, 0.0, 0.0, passed=True, left_out=size)
        if samples == 0:
            return _row(name, size, [self._all_at_once(tested, name in SIZED, rng)], len(left_out))
        part = np.abs(self.adjoint[tested])
        largest = np.argsort(-part)[: samples // 2]
        random = rng.choice(len(tested), min(len(tested), samples - len(largest)), replace=False)
        entries = []
        for i in tested[np.unique(np.concatenate([largest, random]))]:
            direction = np.zeros(len(self.adjoint))
            direction[i] = 1.0
            exact, gradient = probe.complex_step(direction), float(self.adjoint[i])
            size_of = probe.size(float(probe.inputs[i]), 1e-3, name in SIZED, exact)
            found = probe.differences(direction, 1e-4 * size_of, exact)
            moved = self._rounding(direction, self.jitter[:, i], gradient, exact, float(part.max()))
            entries.append(_Entry(gradient, exact, *found, probe.rounding / size_of, moved))
        return _row(name, size, entries, len(left_out))

    def dot_product(self, rng: np.random.Generator) -> float:
        """<J v, w> by tangents against <v, J^T w> by the adjoint, relative to the size of its terms."""
        probe = self.probe
        v = rng.standard_normal(len(probe.inputs)) * np.maximum(np.abs(probe.inputs), 1e-3)
        _, x_dot = probe.core.jvp(probe.inputs, v[None], probe.steps, 0.0)
        forward, backward = float((x_dot[0] * probe.weights).sum()), float(v @ self.adjoint)
        return abs(forward - backward) / max(float(np.abs(v * self.adjoint).sum()), 1e-300)

    def _all_at_once(self, tested: np.ndarray, positive: bool, rng: np.random.Generator) -> _Entry:
        """The derivative along one direction in which every entry of these inputs counts, by its own size and in the
        sense of its gradient, so that nothing cancels."""
        probe, part, own = self.probe, self.adjoint[tested], self.probe.inputs[tested]
        sizes = np.array([probe.size(float(v), 1e-3, positive, float(g)) for v, g in zip(own, part, strict=True)])
        direction = np.zeros(len(probe.inputs))
        mine = sizes * np.where(part < 0, -1.0, 1.0) * rng.uniform(0.5, 1.0, len(part))
        direction[tested] = mine
        exact = probe.complex_step(direction)
        gradient = float(part @ mine)
        moved = self._rounding(direction, self.jitter @ direction, gradient, exact, abs(gradient))
        return _Entry(gradient, exact, *probe.differences(direction, 1e-4, exact), probe.rounding, moved)

    def _rounding(
        self, direction: np.ndarray, jitter: np.ndarray, gradient: float, exact: float, scale: float
    ) -> float:
        """What rounding may make of the gap between adjoint and complex step; the noise of the latter, which costs
        runs, only where it matters."""
        noise = LOUD * float(np.abs(jitter).max())
        if abs(gradient - exact) <= COMPLEX_STEP_BOUND * scale + noise:
            return noise
        return noise + LOUD * self.probe.noise(direction, exact)


def _row(name: str, size: int, entries: Sequence[_Entry], left_out: int = 0) -> GradientRow:
    """The row of the report for some tested entries, with errors relative to the largest."""
    columns = np.array([(e.gradient, e.exact, e.rough, e.error, e.faint, e.rounding) for e in entries]).T
    gradient, exact, rough, error, faint, rounding = columns
    unfelt = bool((np.maximum(np.abs(gradient), np.abs(exact)) <= np.maximum(faint, rounding)).all())
    scale, worst = float(np.abs(exact).max()), float(np.abs(gradient).max())
    if scale == 0.0:
        return GradientRow(
            name, size, worst, worst, float(np.abs(rough).max()), worst == 0.0 or unfelt, unfelt, left_out=left_out
        )
    by_complex, by_differences = np.abs(gradient - exact), np.abs(gradient - rough)
    agrees = (by_complex <= COMPLEX_STEP_BOUND * scale + rounding).all()
    agrees &= ((by_differences <= DIFFERENCES_BOUND * scale + error) | np.isinf(error)).all()
    told = np.isfinite(error)
    far = float(by_differences[told].max(initial=0.0)) / scale
    passed = bool(unfelt or agrees)
    floors = float(error.max()) / scale, float(rounding.max()) / scale
    return GradientRow(name, size, worst, float(by_complex.max()) / scale, far, passed, unfelt, *floors, left_out)


def _present(compiled: CompiledScene) -> list[str]:
    return [name for name, (_, size) in compiled.layout.items() if size > 0]
