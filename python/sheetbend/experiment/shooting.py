"""Multiple shooting: one motion as a chain of windows whose states at the start are numbers of their own.

A run of a chaotic motion forgets its start, and its derivatives explode. In a window they do not. The state at each
border between two windows is lifted out of the motion: a fit finds it together with the parameters, and asks that every
window ends where the next one begins (Bock 1983). That is asked softly. Real motions leave their models by a little at
every instant, and gaps at the borders take that up (Bezruchko, Smirnov & Sysoev 2006, International Journal of
Bifurcation and Chaos 16; it is the weak constraint of data assimilation). Their size says what the model loses.

A state is the values of the quantities that set how the scene starts and nothing else, such as the angles and the rates
of arms. A gap is told in m: the distance of the places, and the difference of the velocities times the `pace` of the
motion, both root mean squares over the free particles.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from ..arrays.checks import MOST_WHOLE, check_count, is_number
from ..errors import InputError

AUTO = "auto"


@dataclass(frozen=True)
class Shooting:
    """How a motion is cut into windows, and how large the gaps between windows may be (multiple shooting).

    Attributes:
        window: s, length of a window, or "auto". The fitted part is cut into windows of equal length, none longer.
        loss: m/s, the expected gap divided by the length of a window; None estimates it from the recording. A tiny
            value, such as 1e-6, requires a motion without gaps.
        behind: s, how long after a border the gap is measured, so that the first substeps of the window's integrator
            have no effect. Velocities there are differences over the same time. None = chosen when the fit begins.
        pace: s, by which differences of velocities are multiplied. None = chosen when the fit begins.
        states: (borders, quantities of the start), where the search begins; empty = chosen when the fit begins.
        is_given: whether the user gave the loss.
        steps: largest number of Gauss-Newton steps of the states in one evaluation.
    """

    window: float | str = AUTO
    loss: float | None = None
    behind: float | None = None
    pace: float | None = None
    states: tuple[tuple[float, ...], ...] = ()
    is_given: bool = False
    steps: int = 30

    def __post_init__(self) -> None:
        length = 1.0 if isinstance(self.window, str) and self.window == AUTO else self.window
        if not (is_number(length) and length > 0):  # type: ignore[operator]
            fix = "give the length of a window in s, or 'auto'"
            raise InputError("shooting.window", "must be a length", self.window, fix)
        for field in ("loss", "behind", "pace"):
            value = getattr(self, field)
            if value is not None and not (is_number(value) and value >= 0):
                raise InputError(f"shooting.{field}", "must not be negative", value, "give a number, or leave it out")
        check_count("shooting.steps", self.steps, 1, MOST_WHOLE, InputError)

    @staticmethod
    def given(name: str, wanted: object, beside: Mapping[str, bool]) -> Shooting | None:
        """What an experiment was given, checked.

        Args:
            name: of the experiment.
            wanted: its `shooting`.
            beside: whether it has the fields that do not go with that, by name.

        Raises:
            InputError: it is no length, or does not go with another field.
        """
        field = f"{name}.shooting"
        if wanted is None:
            return None
        own = wanted if isinstance(wanted, Shooting) else Shooting(wanted)  # type: ignore[arg-type]
        if own.window != AUTO and not (is_number(own.window) and own.window > 0):  # type: ignore[operator]
            raise InputError(field, "must be a length", own.window, "give the length of a window in s, or 'auto'")
        if own.loss is not None and not (is_number(own.loss) and own.loss > 0):
            raise InputError(f"{field}.loss", "must be positive", own.loss, "give it in m/s, or leave it out")
        if fields := [other for other, is_given in beside.items() if is_given]:
            raise InputError(field, "does not go with", fields, "leave one of the two out")
        return own
