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

from ..errors import InputError
from ..scene.compiled import CompiledScene
from ..scene.scene import Scene
from .gradient_probe import DIFFERENCES_BOUND, JITTERS, LOUD, Probe, jittered
from .simulate import divergence, substeps
from .solver import Solver
from .tape import budget

COMPLEX_STEP_BOUND = 1e-8
DOT_PRODUCT_BOUND = 1e-9
RUNS = 6.0  # of the scene for differences along one direction, mostly
SHORTER = (1.0, 0.5, 0.25, 0.125)
POSITIVE = (
    *("mass", "compliance", "damping", "drag_linear", "drag_quadratic", "air_normal", "air_tangential"),
    *("volume", "volume_compliance", "friction", "contact_radius", "contact_stiffness", "collider_size", "restitution"),
    "contact_dissipation",
)


@dataclass(frozen=True)
class GradientRow:
    """One gradient against its references; errors are relative to the largest entry of the reference.

    Attributes:
        name: a named quantity, or an input array such as "position".
        size: entries; entries tested (large arrays are sampled).
        gradient: its largest absolute entry.
        complex_step: error against complex step through the templated solver.
        differences: error against central differences, whose own accuracy limits it.
        passed: complex step within its bound, differences within theirs, or within their noise; or nothing is felt.
        rounding: what complex step and adjoint may differ by for rounding, likewise relative.
        noise: what differences may be off by for their own error (infinite where none could be taken).
        unfelt: moving any tested entry by its own size changes the loss by less than rounding does, by the adjoint and
            by complex step; relative errors of such a gradient mean nothing.
    """

    name: str
    size: int
    gradient: float
    complex_step: float
    differences: float
    passed: bool
    unfelt: bool = False
    noise: float = 0.0
    rounding: float = 0.0


@dataclass(frozen=True)
class GradientReport:
    """The result of `check_gradients`.

    Attributes:
        scene, steps: its name, and the substeps of the stretch.
        rows: one per quantity and array.
        dot_product: relative gap of <J v, w> = <v, J^T w> for random v, w.
        sampled: what was left out to keep to a time limit, in words; empty where nothing was.
    """

    scene: str
    steps: int
    rows: tuple[GradientRow, ...]
    dot_product: float
    sampled: str = ""

    @property
    def passed(self) -> bool:
        """Whether every row and the dot product pass."""
        return all(row.passed for row in self.rows) and self.dot_product <= DOT_PRODUCT_BOUND

    def to_dict(self) -> dict[str, Any]:
        """For JSON: each gradient by name with its relative errors and pass or fail."""
        gradients = {
            r.name: {
                "size": r.size,
                "gradient": r.gradient,
                "complex_step": r.complex_step,
                "differences": r.differences,
                "rounding": r.rounding,
                "noise": r.noise if math.isfinite(r.noise) else None,
                "passed": r.passed,
                "unfelt": r.unfelt,
            }
            for r in self.rows
        }
        return {
            "scene": self.scene,
            "steps": self.steps,
            "gradients": gradients,
            "dot_product": self.dot_product,
            "sampled": self.sampled,
            "passed": self.passed,
        }

    def __str__(self) -> str:
        lines = [
            f"Gradient check of '{self.scene}' over {self.steps} substeps: {'passed' if self.passed else 'FAILED'}"
        ]
        if self.sampled:
            lines.append(f"  {self.sampled}")
        width = max(len(r.name) for r in self.rows)
        lines.append(f"  {'':{width}}  {'entries':>7}  {'largest':>9}  {'complex step':>12}  {'differences':>11}")
        for r in self.rows:
            mark = "  nothing felt beyond rounding" if r.unfelt else _noisy(r) if r.passed else "  <- fails"
            lines.append(
                f"  {r.name:{width}}  {r.size:7d}  {r.gradient:9.2e}"
                f"  {r.complex_step:12.1e}  {r.differences:11.1e}{mark}"
            )
        lines.append(f"  dot product <Jv, w> = <v, J'w>: {self.dot_product:.1e}")
        lines.append(
            f"  bounds: complex step {COMPLEX_STEP_BOUND:g}, differences {DIFFERENCES_BOUND:g},"
            f" dot product {DOT_PRODUCT_BOUND:g}"
        )
        return "\n".join(lines)


def _noisy(row: GradientRow) -> str:
    """Which path cannot be judged down to its bound, and down to what it can."""
    words = [f"complex step good to {row.rounding:.0e}"] if row.rounding > COMPLEX_STEP_BOUND else []
    if row.noise > DIFFERENCES_BOUND:
        words.append(f"differences good to {row.noise:.0e}" if math.isfinite(row.noise) else "no differences")
    return "".join(f"  {part}" for part in words)


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

    The loss is a random linear combination of all positions at `times`. Arrays with more than `samples` entries are
    tested on the largest gradient entries and on random ones.

    Args:
        scene: is frozen by this.
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
    solver = Solver.given(solver)
    steps = substeps(times, solver.h)
    if steps[-1] == 0:
        raise InputError("times", "hold no substep to check", times, f"give frames up to {4 * solver.h:g} s or later")
    if samples < 1:
        raise InputError("samples", "must be positive", samples, "give at least 1")
    compiled = scene.compiled
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
        jitter = _jitter(core, inputs, steps, weights, adjoint, solver, np.random.default_rng(seed + 1))
        rows = [
            _quantity_row(compiled, probe, theta, adjoint, jitter, name, scene.quantities[name].positive)
            for name in compiled.names
        ]
        rows += [_array_row(compiled, probe, adjoint, jitter, name, samples, rng) for name in _present(compiled)]
        dot = _dot_product(core, inputs, steps, weights, adjoint, rng)
    return GradientReport(scene.name, steps[-1], tuple(rows), dot, sampled)


def _jitter(
    core: Any,
    inputs: np.ndarray,
    steps: Sequence[int],
    weights: np.ndarray,
    adjoint: np.ndarray,
    solver: Solver,
    rng: np.random.Generator,
) -> np.ndarray:
    """(JITTERS, inputs) by how much the adjoint moves when the last digits of the inputs do."""
    moved = []
    for _ in range(JITTERS):
        x = jittered(inputs, rng)
        moved.append(core.vjp(x, core.record(x, steps, 0.0, solver.budget)[1], steps, weights, 0.0) - adjoint)
    return np.array(moved)


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


def _quantity_row(
    compiled: CompiledScene,
    probe: Probe,
    theta: np.ndarray,
    adjoint: np.ndarray,
    jitter: np.ndarray,
    name: str,
    positive: bool,
) -> GradientRow:
    direction = np.zeros(len(theta))
    direction[compiled.names.index(name)] = 1.0
    gradient = float(compiled.theta_bar(theta, adjoint) @ direction)
    along = compiled.inputs_dot(theta, direction)
    exact = probe.complex_step(along)
    size = probe.size(float(theta @ direction), 1e-2, positive, exact)
    moved = _rounding(probe, along, jitter @ along, gradient, exact, abs(gradient))
    found = probe.differences(along, 1e-4 * size, exact)
    return _row(name, 1, [_Entry(gradient, exact, *found, probe.rounding / size, moved)])


def _array_row(
    compiled: CompiledScene,
    probe: Probe,
    adjoint: np.ndarray,
    jitter: np.ndarray,
    name: str,
    samples: int,
    rng: np.random.Generator,
) -> GradientRow:
    offset, size = compiled.layout[name]
    part, own = adjoint[offset : offset + size], probe.inputs[offset : offset + size]
    if samples == 0:
        return _row(name, size, [_all_at_once(probe, part, jitter, own, offset, name in POSITIVE, rng)])
    largest = np.argsort(-np.abs(part))[: samples // 2]
    tested = np.unique(np.concatenate([largest, rng.choice(size, min(size, samples - len(largest)), replace=False)]))
    entries = []
    for i in tested:
        direction = np.zeros(len(adjoint))
        direction[offset + i] = 1.0
        exact = probe.complex_step(direction)
        size_of = probe.size(float(own[i]), 1e-3, name in POSITIVE, exact)
        found = probe.differences(direction, 1e-4 * size_of, exact)
        moved = _rounding(probe, direction, jitter[:, offset + i], float(part[i]), exact, float(np.abs(part).max()))
        entries.append(_Entry(float(part[i]), exact, *found, probe.rounding / size_of, moved))
    return _row(name, size, entries)


def _all_at_once(
    probe: Probe,
    part: np.ndarray,
    jitter: np.ndarray,
    own: np.ndarray,
    offset: int,
    positive: bool,
    rng: np.random.Generator,
) -> _Entry:
    """The derivative along one direction in which every entry of an array counts, by its own size and in the sense of
    its gradient, so that nothing cancels."""
    sizes = np.array([probe.size(float(v), 1e-3, positive, float(g)) for v, g in zip(own, part, strict=True)])
    direction = np.zeros(len(probe.inputs))
    mine = sizes * np.where(part < 0, -1.0, 1.0) * rng.uniform(0.5, 1.0, len(part))
    direction[offset : offset + len(part)] = mine
    exact = probe.complex_step(direction)
    gradient = float(part @ mine)
    moved = _rounding(probe, direction, jitter @ direction, gradient, exact, abs(gradient))
    return _Entry(gradient, exact, *probe.differences(direction, 1e-4, exact), probe.rounding, moved)


def _rounding(
    probe: Probe, direction: np.ndarray, jitter: np.ndarray, gradient: float, exact: float, scale: float
) -> float:
    """What rounding may make of the gap between adjoint and complex step; the noise of the latter, which costs runs,
    only where it matters."""
    noise = LOUD * float(np.abs(jitter).max())
    if abs(gradient - exact) <= COMPLEX_STEP_BOUND * scale + noise:
        return noise
    return noise + LOUD * probe.noise(direction, exact)


def _row(name: str, size: int, entries: Sequence[_Entry]) -> GradientRow:
    """Of tested entries, relative to the largest."""
    columns = np.array([(e.gradient, e.exact, e.rough, e.error, e.faint, e.rounding) for e in entries]).T
    gradient, exact, rough, error, faint, rounding = columns
    unfelt = bool((np.maximum(np.abs(gradient), np.abs(exact)) <= faint).all())
    scale, worst = float(np.abs(exact).max()), float(np.abs(gradient).max())
    if scale == 0.0:
        return GradientRow(name, size, worst, worst, float(np.abs(rough).max()), worst == 0.0 or unfelt, unfelt)
    by_complex, by_differences = np.abs(gradient - exact), np.abs(gradient - rough)
    agrees = (by_complex <= COMPLEX_STEP_BOUND * scale + rounding).all()
    agrees &= ((by_differences <= DIFFERENCES_BOUND * scale + error) | np.isinf(error)).all()
    told = np.isfinite(error)
    far = float(by_differences[told].max(initial=0.0)) / scale
    passed = bool(unfelt or agrees)
    floors = float(error.max()) / scale, float(rounding.max()) / scale
    return GradientRow(name, size, worst, float(by_complex.max()) / scale, far, passed, unfelt, *floors)


def _present(compiled: CompiledScene) -> list[str]:
    return [name for name, (_, size) in compiled.layout.items() if size > 0]


def _dot_product(
    core: Any,
    inputs: np.ndarray,
    steps: Sequence[int],
    weights: np.ndarray,
    adjoint: np.ndarray,
    rng: np.random.Generator,
) -> float:
    """<J v, w> by tangents against <v, J^T w> by the adjoint, relative to the size of its terms."""
    v = rng.standard_normal(len(inputs)) * np.maximum(np.abs(inputs), 1e-3)
    _, x_dot = core.jvp(inputs, v[None], steps, 0.0)
    forward, backward = float((x_dot[0] * weights).sum()), float(v @ adjoint)
    return abs(forward - backward) / max(float(np.abs(v * adjoint).sum()), 1e-300)
