"""The place on a test's dial at which a measure reaches what the standard asks for."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

from ..errors import NoEquilibriumError

_MOST = 60  # steps and halvings together
_CLOSE = 1e-10  # of the measure, whose scale is 1

State = TypeVar("State")


def root(measure: Callable[[float], tuple[float, float, State]], start: float) -> tuple[float, State]:
    """Newton's method with halved steps on measure(q) = (value, slope, state), value of order 1 and 0 at the root.

    Raises:
        NoEquilibriumError: the measure does not get to zero.
    """
    q = start
    value, slope, state = measure(q)
    step = -value / slope
    for _ in range(_MOST):
        if abs(value) <= _CLOSE:
            return q, state
        try:
            tried, its_slope, its_state = measure(q + step)
        except NoEquilibriumError:
            step *= 0.5
            continue
        if abs(tried) < abs(value):
            q, value, slope, state = q + step, tried, its_slope, its_state
            step = -value / slope
        else:
            step *= 0.5
    raise NoEquilibriumError(
        f"the test found no setting that reads what its standard asks for: at {q:.6g} it is off by {value:.1e} of it. "
        "Fix: check the fabric's numbers, or refine the mesh"
    )
