"""A gradient check that users can run on their own scene: the adjoint against independent paths."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from . import _core
from .compiled import CompiledScene
from .errors import InputError
from .scene import Scene
from .simulate import divergence, substeps
from .solver import Solver
from .tape import budget

COMPLEX_STEP_BOUND = 1e-8
DOT_PRODUCT_BOUND = 1e-9
DIFFERENCES_BOUND = 1e-4
STEP_FACTORS = (1e4, 1e2, 1.0, 1e-2)
POSITIVE = (
    *("mass", "compliance", "damping", "drag_linear", "drag_quadratic", "air_normal", "air_tangential"),
    *("volume", "volume_compliance"),
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
        passed: complex step within its bound, differences within theirs; or nothing is felt.
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


@dataclass(frozen=True)
class GradientReport:
    """What `check_gradients` found. `dot_product` is the relative gap of <J v, w> = <v, J^T w> for random v, w."""

    scene: str
    steps: int
    rows: tuple[GradientRow, ...]
    dot_product: float

    @property
    def passed(self) -> bool:
        return all(row.passed for row in self.rows) and self.dot_product <= DOT_PRODUCT_BOUND

    def to_dict(self) -> dict[str, Any]:
        """For JSON: each gradient by name with its relative errors and pass or fail."""
        gradients = {
            r.name: {
                "size": r.size,
                "gradient": r.gradient,
                "complex_step": r.complex_step,
                "differences": r.differences,
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
            "passed": self.passed,
        }

    def __str__(self) -> str:
        lines = [
            f"Gradient check of '{self.scene}' over {self.steps} substeps: {'passed' if self.passed else 'FAILED'}"
        ]
        width = max(len(r.name) for r in self.rows)
        lines.append(f"  {'':{width}}  {'entries':>7}  {'largest':>9}  {'complex step':>12}  {'differences':>11}")
        for r in self.rows:
            mark = "  nothing felt beyond rounding" if r.unfelt else "" if r.passed else "  <- fails"
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


def check_gradients(
    scene: Scene,
    times: ArrayLike,
    solver: Solver | None = None,
    samples: int = 6,
    seed: int = 0,
    values: Mapping[str, float] | None = None,
) -> GradientReport:
    """Check the adjoint of a scene's rollout for every named quantity and every input array.

    The loss is a random linear combination of all positions at `times`. Arrays with more than `samples` entries are
    tested on the largest gradient entries and on random ones.

    Args:
        times: (frames,) s on the substep grid; a short stretch of motion is enough.
        values: quantities to change, by name.

    Raises:
        InputError, DivergenceError: as `simulate`; times without a substep, or fewer than one sample.
    """
    solver = solver or Solver()
    steps = substeps(times, solver.h)
    if steps[-1] == 0:
        raise InputError("times", "hold no substep to check", times, f"give frames up to {4 * solver.h:g} s or later")
    if samples < 1:
        raise InputError("samples", "must be positive", samples, "give at least 1")
    compiled = scene.compiled
    rng = np.random.default_rng(seed)
    core = solver.core(compiled)
    theta = compiled.values(values)
    inputs = compiled.inputs(theta)
    with divergence(scene), budget(solver):
        _, tape = core.record(inputs, steps, 0.0, solver.budget)
        weights = rng.standard_normal((len(steps), compiled.core.dofs))
        adjoint = core.vjp(inputs, tape, steps, weights, 0.0)
        probe = _Probe(core, inputs, steps, weights)
        rows = [
            _quantity_row(compiled, probe, theta, adjoint, name, scene.quantities[name].positive)
            for name in compiled.names
        ]
        rows += [_array_row(compiled, probe, adjoint, name, samples, rng) for name in _present(compiled)]
        dot = _dot_product(core, inputs, steps, weights, adjoint, rng)
    return GradientReport(scene.name, steps[-1], tuple(rows), dot)


class _Probe:
    """Derivatives of the loss along directions of the inputs, by the two independent paths."""

    def __init__(self, core: Any, inputs: np.ndarray, steps: Sequence[int], weights: np.ndarray) -> None:
        self.core, self.inputs, self.steps, self.weights = core, inputs, steps, weights
        self.rounding = np.finfo(float).eps * float(
            np.abs(core.simulate(inputs, steps, 0.0)["positions"] * weights).sum()
        )

    def complex_step(self, direction: np.ndarray) -> float:
        return float((self.core.complex_step(self.inputs, direction, self.steps, 0.0) * self.weights).sum())

    def loss(self, inputs: np.ndarray) -> float:
        return float((self.core.simulate(inputs, self.steps, 0.0)["positions"] * self.weights).sum())

    def differences(self, direction: np.ndarray, step: float) -> float:
        """Central differences with one Richardson step, at the step size where truncation and rounding together are
        least.

        No single step suits all: rounding drowns a faint gradient at small ones, and rigid links turn soft at large
        ones. How much halving the step changes the differences tells their truncation error (Ridders 1982).
        """

        def at(size: float) -> tuple[float, float]:
            try:
                coarse, fine = self._central(direction, size), self._central(direction, size / 2.0)
            except (_core.Diverged, _core.Unconverged):  # a step as large as a mass
                return np.inf, np.nan
            return abs(fine - coarse) + self.rounding / size, (4.0 * fine - coarse) / 3.0

        return min(at(step * factor) for factor in STEP_FACTORS)[1]

    def _central(self, direction: np.ndarray, step: float) -> float:
        return (self.loss(self.inputs + step * direction) - self.loss(self.inputs - step * direction)) / (2.0 * step)


def _quantity_row(
    compiled: CompiledScene, probe: _Probe, theta: np.ndarray, adjoint: np.ndarray, name: str, positive: bool
) -> GradientRow:
    direction = np.zeros(len(theta))
    direction[compiled.names.index(name)] = 1.0
    gradient = float(compiled.theta_bar(theta, adjoint) @ direction)
    along = compiled.inputs_dot(theta, direction)
    size = _size(float(theta @ direction), 1e-2, positive)
    exact, rough = probe.complex_step(along), probe.differences(along, 1e-4 * size)
    faint = np.array([probe.rounding / size])
    return _row(name, 1, np.array([gradient]), np.array([exact]), np.array([rough]), faint)


def _size(value: float, least: float, positive: bool) -> float:
    """What a step is judged against: a positive number's own size, however small."""
    return value if positive and value > 0 else max(abs(value), least)


def _array_row(
    compiled: CompiledScene, probe: _Probe, adjoint: np.ndarray, name: str, samples: int, rng: np.random.Generator
) -> GradientRow:
    offset, size = compiled.layout[name]
    part = adjoint[offset : offset + size]
    largest = np.argsort(-np.abs(part))[: samples // 2]
    tested = np.unique(np.concatenate([largest, rng.choice(size, min(size, samples - len(largest)), replace=False)]))
    exact, rough, faint = [], [], []
    for i in tested:
        direction = np.zeros(len(adjoint))
        direction[offset + i] = 1.0
        exact.append(probe.complex_step(direction))
        size_of = _size(float(probe.inputs[offset + i]), 1e-3, name in POSITIVE)
        rough.append(probe.differences(direction, 1e-4 * size_of))
        faint.append(probe.rounding / size_of)
    return _row(name, size, part[tested], np.array(exact), np.array(rough), np.array(faint))


def _row(
    name: str, size: int, gradient: np.ndarray, exact: np.ndarray, rough: np.ndarray, faint: np.ndarray
) -> GradientRow:
    """Of tested entries; `faint` is what each may be without being felt."""
    unfelt = bool((np.maximum(np.abs(gradient), np.abs(exact)) <= faint).all())
    scale = float(np.abs(exact).max())
    if scale == 0.0:
        worst = float(np.abs(gradient).max())
        return GradientRow(name, size, worst, worst, float(np.abs(rough).max()), worst == 0.0 or unfelt, unfelt)
    complex_error = float(np.abs(gradient - exact).max()) / scale
    difference_error = float(np.abs(gradient - rough).max()) / scale
    passed = unfelt or (complex_error <= COMPLEX_STEP_BOUND and difference_error <= DIFFERENCES_BOUND)
    return GradientRow(name, size, float(np.abs(gradient).max()), complex_error, difference_error, passed, unfelt)


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
