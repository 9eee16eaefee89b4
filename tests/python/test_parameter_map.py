"""The map from quantities to inputs: sums of products, beside NumPy, and its tangents and cotangents."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from typing import Any

import numpy as np
from sheetbend import _core

Array = np.ndarray
INPUTS, QUANTITIES, TERMS = 12, 5, 300
FUNCTIONS: tuple[Callable[[Array, float], Array], ...] = (
    lambda x, w: x,
    lambda x, w: 1 / x,
    lambda x, w: x**2,
    lambda x, w: np.sin(x),
    lambda x, w: np.cos(x),
    lambda x, w: np.sqrt(x),
    lambda x, w: 1 / np.sqrt(x),
    lambda x, w: np.exp(w * x),
    lambda x, w: 1 / (1 + x),
    lambda x, w: 1 / (1 - 2 * x),
)


def terms(rng: np.random.Generator) -> dict[str, Any]:
    """Many terms, of which some that follow each other have the same factors, or only other weights."""
    every: list[list[tuple[int, int, float]]] = []
    while len(every) < TERMS:
        factors = [
            (int(rng.integers(QUANTITIES)), int(rng.integers(len(FUNCTIONS))), float(rng.normal()))
            for _ in range(rng.integers(0, 4))
        ]
        every += [factors] * int(rng.integers(1, 4)) + [[(q, f, w + 0.5) for q, f, w in factors]]
    every = every[:TERMS]
    flat = [factor for factors in every for factor in factors]
    return {
        "base": rng.normal(size=INPUTS),
        "target": rng.integers(0, INPUTS, TERMS),
        "coefficient": rng.normal(size=TERMS),
        "first_factor": np.concatenate([[0], np.cumsum([len(factors) for factors in every])]),
        "parameter": np.array([q for q, _, _ in flat]),
        "function": np.array([f for _, f, _ in flat]),
        "weight": np.array([w for _, _, w in flat]),
    }


def by_numpy(arrays: dict[str, Any], theta: Array) -> Array:
    inputs = arrays["base"].astype(theta.dtype)
    for t in range(TERMS):
        own = range(arrays["first_factor"][t], arrays["first_factor"][t + 1])
        factors = [FUNCTIONS[arrays["function"][k]](theta[arrays["parameter"][k]], arrays["weight"][k]) for k in own]
        inputs[arrays["target"][t]] += arrays["coefficient"][t] * np.prod(factors)
    return inputs


def test_inputs_and_their_derivatives_are_those_of_the_sum() -> None:
    rng = np.random.default_rng(3)
    arrays, theta, step = terms(rng), rng.uniform(0.6, 1.4, QUANTITIES), rng.normal(size=QUANTITIES)
    for found in (_core.ParameterMap(arrays), pickle.loads(pickle.dumps(_core.ParameterMap(arrays)))):
        np.testing.assert_allclose(found.inputs(theta), by_numpy(arrays, theta), rtol=1e-12, atol=1e-12)
        along = by_numpy(arrays, theta + 1e-30j * step).imag / 1e-30
        np.testing.assert_allclose(found.inputs_dot(theta, step), along, rtol=1e-11, atol=1e-11)
        bar = rng.normal(size=INPUTS)
        assert abs(found.theta_bar(theta, bar) @ step - bar @ along) < 1e-11 * abs(bar) @ abs(along)


def test_the_derivative_of_cotangents_is_symmetric() -> None:
    rng = np.random.default_rng(4)
    arrays, theta, bar = terms(rng), rng.uniform(0.6, 1.4, QUANTITIES), rng.normal(size=INPUTS)
    found = _core.ParameterMap(arrays)
    value, still = found.theta_bar(theta, bar), np.zeros(INPUTS)
    rows = [found.theta_bar_dot(theta, unit, bar, still) for unit in np.eye(QUANTITIES)]
    second = np.array([derivative for _, derivative in rows])
    np.testing.assert_allclose(second, second.T, rtol=1e-10)
    assert all(np.array_equal(own, value) for own, _ in rows)
    step = 1e-6 * rng.normal(size=QUANTITIES)
    change = (found.theta_bar(theta + step, bar) - found.theta_bar(theta - step, bar)) / 2
    np.testing.assert_allclose(step @ second, change, rtol=1e-6, atol=1e-12)
