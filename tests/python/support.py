"""Derivatives of rollouts and of equilibria for the physics tests, each by two independent paths, and estimators of
what a motion shows."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace

import numpy as np
import pytest
import sheetbend as sb
from numpy.typing import ArrayLike
from oracles import integration
from pytest import approx
from scipy.optimize import brentq
from sheetbend import _core
from sheetbend.motion.core_terms import substeps
from sheetbend.objects.stiffness_field import StiffnessField

Array = np.ndarray
Direction = str | Mapping[str, ArrayLike]
"""What is varied: a named quantity, or tangents of input arrays by name (such as `{"rest": [1.0]}`)."""


def steps(h: float, count: int) -> Array:
    """Times of substeps 0 to count, shape (count + 1,) s."""
    return h * np.arange(count + 1)


def twice(expected: ArrayLike) -> tuple[float, float]:
    """What `sensitivity` is to give, by both of its paths."""
    return float(expected), float(expected)


def unit_vector(rng: np.random.Generator) -> Array:
    """(3,), of any direction."""
    v = rng.standard_normal(3)
    return np.asarray(v / np.linalg.norm(v))


def place(trajectory_frames: int, scene: sb.Scene, frame: int, particle: int, axis: int, weight: float = 1.0) -> Array:
    """Weights (frames, particles, 3) that pick one coordinate of one particle at one frame."""
    weights = np.zeros((trajectory_frames, scene.particle_count, 3))
    weights[frame, particle, axis] = weight
    return weights


def pick(scene: sb.Scene, particle: int, axis: int, weight: float = 1.0) -> Array:
    """Weights (particles, 3) that pick one coordinate of one particle."""
    weights = np.zeros((scene.particle_count, 3))
    weights[particle, axis] = weight
    return weights


def inputs_dot(scene: sb.Scene, direction: Direction) -> Array:
    """Tangent of the flat inputs for a direction."""
    compiled = scene.compiled
    if isinstance(direction, str):
        theta_dot = np.zeros(len(compiled.theta))
        theta_dot[compiled.names.index(direction)] = 1.0
        return compiled.inputs_dot(compiled.theta, theta_dot)
    tangent = np.zeros(compiled.core.inputs)
    for array, values in direction.items():
        offset, size = compiled.layout[array]
        if np.size(values) != size:  # of the particles alone
            offset, size = compiled.given[array]
        tangent[offset : offset + size] = np.ravel(values)
    return tangent


def tangents(scene: sb.Scene, times: ArrayLike, solver: sb.Solver, direction: Direction) -> Array:
    """d(positions)/d(direction) by forward tangents, shape (frames, particles, 3)."""
    compiled, frames = scene.compiled, substeps(times, solver.h)
    _, x_dot = solver.core(compiled).jvp(compiled.inputs(), inputs_dot(scene, direction)[None], frames, 0.0)
    return x_dot[0].reshape(len(frames), -1, 3)[:, : scene.particle_count]


def sensitivity(
    scene: sb.Scene, times: ArrayLike, solver: sb.Solver, weights: Array, direction: Direction
) -> tuple[float, float]:
    """d(sum of weights * positions)/d(direction), by forward tangents and by the adjoint.

    Args:
        weights: (frames, particles, 3).
    """
    compiled, frames = scene.compiled, substeps(times, solver.h)
    core, inputs = solver.core(compiled), compiled.inputs()
    forward = float((tangents(scene, times, solver, direction) * weights).sum())
    _, tape = core.record(inputs, frames, 0.0)
    every = np.zeros((len(frames), scene.node_count, 3))
    every[:, : scene.particle_count] = np.reshape(weights, (len(frames), -1, 3))
    bar = core.vjp(inputs, tape, frames, every.reshape(len(frames), -1), 0.0)
    if isinstance(direction, str):
        return forward, float(compiled.theta_bar(compiled.theta, bar)[compiled.names.index(direction)])
    return forward, float(bar @ inputs_dot(scene, direction))


def static_sensitivity(
    rest: sb.Equilibrium,
    direction: Direction,
    weights: Array | None = None,
    forces: Mapping[str, Array] | None = None,
    pressures: Mapping[str, float] | None = None,
) -> tuple[float, float]:
    """d(sum of weights * positions + of force weights * forces + of pressure weights * pressures)/d(direction) of an
    equilibrium, forward and reverse.

    Args:
        weights: (particles, 3).
        forces: per group (count, rows).
        pressures: per volume.
    """
    scene = rest.scene
    tangent = inputs_dot(scene, direction)
    x_bar = np.zeros_like(rest.nodes)
    x_bar[: scene.particle_count] = 0.0 if weights is None else weights
    parts = {name: np.zeros(f.shape) for name, f in rest.forces.items()} | dict(forces or {})
    volumes = dict.fromkeys(rest.pressures, 0.0) | dict(pressures or {})
    lambda_bar = np.concatenate([*(part.ravel() for part in parts.values()), list(volumes.values())])
    forward = float(_core.equilibria_jvp([rest.solution], tangent[None])[0] @ np.append(x_bar, lambda_bar))
    if isinstance(direction, str):
        return forward, rest.gradient(x_bar, parts, volumes)[direction]
    return forward, float(rest.solution.vjp(x_bar.ravel(), lambda_bar) @ tangent)


def refitted(
    scene: sb.Scene, times: ArrayLike, solver: sb.Solver, seen: Sequence[int], start: Mapping[str, float]
) -> sb.Fit:
    """A fit to the scene's own motion, of the particles that are seen, from other values."""
    x = sb.simulate(scene, times, solver).positions[:, seen]
    recording = sb.Recording(positions=x, times=times, name="twin")
    parameters = {name: {"initial": value} for name, value in start.items()}
    places = [sb.on_particle(n) for n in seen]
    return sb.fit(scene, recording, parameters, markers=places, solver=solver, refine=False)


def slope_along(estimate: Callable[[Array], float], series: Array, series_dot: Array) -> float:
    """d(estimate)/d(parameter) of an estimator of a series whose derivative with respect to the parameter is
    `series_dot`.

    Central differences along the known tangent, with one Richardson step; good to about 1e-9 relative.
    """
    scale = 1e-3 * float(np.abs(series).max()) / float(np.abs(series_dot).max())
    coarse, fine = (
        (estimate(series + e * series_dot) - estimate(series - e * series_dot)) / (2.0 * e)
        for e in (scale, scale / 2.0)
    )
    return (4.0 * fine - coarse) / 3.0


def step_factor(series: ArrayLike) -> complex:
    """z of a series u_n = Re(c z^n), Im z > 0: least squares on its recurrence u_{n+2} = 2 Re z u_{n+1} - |z|^2 u_n."""
    u = np.asarray(series, dtype=float)
    (a, b), *_ = np.linalg.lstsq(np.stack([u[1:-1], -u[:-2]], axis=1), u[2:], rcond=None)
    return complex(a / 2.0, np.sqrt(b - a * a / 4.0))


def shown_frequency(h: float, order: int) -> Callable[[Array], float]:
    """Estimator of the frequency [rad/s] that a series over steps h shows, without the integrator's shift."""

    def estimate(series: Array) -> float:
        seen = float(np.angle(step_factor(series)))
        return brentq(
            lambda omega: integration.numerical_frequency(omega, h, order) * h - seen,
            0.5 * seen / h,
            2.0 * seen / h,
            xtol=1e-15,
            rtol=1e-15,
        )

    return estimate


def crossings(times: Array, series: Array) -> Array:
    """Times at which a smooth series passes zero, by the cubic through the four nearest samples."""
    found = []
    for n in np.nonzero(np.sign(series[1:-2]) * np.sign(series[2:-1]) < 0)[0] + 1:
        window = slice(n - 1, n + 3)
        local = (times[window] - times[n]) / (times[n + 1] - times[n])
        roots = np.roots(np.polyfit(local, series[window], 3))
        real = roots[np.abs(roots.imag) < 1e-9].real
        inside = real[(real >= 0.0) & (real <= 1.0)]
        found.append(times[n] + inside[0] * (times[n + 1] - times[n]))
    return np.array(found)


def period(times: Array, series: Array) -> float:
    """Twice the time from the first zero crossing to the second."""
    first, second = crossings(times, series)[:2]
    return 2.0 * float(second - first)


def observed_orders(errors: Sequence[float]) -> Array:
    """log2 of the ratios of errors at h, h/2, h/4, ..."""
    e = np.abs(np.asarray(errors, dtype=float))
    return np.log2(e[:-1] / e[1:])


def by_fabric(read: Callable[[sb.Fabric], float], fabric: sb.Fabric, field: str, share: float = 1e-4) -> float:
    """Central difference of a laboratory's number by one of the fabric's."""
    value = getattr(fabric, field)
    step = share * (value or 1.0)
    high, low = (read(replace(fabric, **{field: value + sign * step})) for sign in (1.0, -1.0))
    return (high - low) / (2.0 * step)


def expect_exact(report: sb.GradientReport, *felt: str) -> None:
    """A check has found all gradients exact, and that of these quantities more than rounding."""
    assert report.passed, str(report)
    rows = {row.name: row for row in report.rows}
    for name in felt:
        assert not rows[name].unfelt and rows[name].gradient != 0.0, name


@contextmanager
def refusal(field: str, words: str = "", error: type[sb.InputError] = sb.SceneError) -> Iterator[None]:
    """What is done inside is refused: the error names the field, says these words and has a fix."""
    with pytest.raises(error) as caught:
        yield
    assert caught.value.field == field and caught.value.fix
    assert words in f"{caught.value.problem}. {caught.value.fix}", str(caught.value)


def expect_modes_scale(scene: sb.Scene, field: StiffnessField, q: Array, group: str) -> None:
    """The modes of a field, at the values q, scale compliances and damping of a group, and no other input."""
    compiled, names = scene.compiled, list(scene.quantities)
    values = np.array([scene.quantities[name].value for name in names])
    plain = compiled.inputs(values)
    values[[names.index(mode) for mode in field.modes]] = q
    varied, factor = compiled.inputs(values), np.exp(field.shapes @ q)
    for array, power in (("compliance", -1.0), ("damping", 1.0)):
        at, _ = compiled.layout[array]
        _, first, _ = scene.group(group)
        own = slice(at + first, at + first + len(factor))
        assert varied[own] == approx(plain[own] * factor**power)
        plain[own] = varied[own]
    assert np.array_equal(plain, varied)
