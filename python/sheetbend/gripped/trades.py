"""What the motion of a gripped rope shows only in combination, or from one side: in words, from a fit's result."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from ..arrays.checks import check_kind
from ..quantities.wording import short
from ..report.fit_result import FitResult
from ..result.estimate import Estimate
from .model import NAME
from .over_density import as_quantities, in_units, is_over_density, quantity

STRONG = 0.8  # correlation (absolute value) from which two parameters are said to trade
LOOSE = 3.0  # upper end of an interval over the value from which a stiffness is not bounded from above

Values = Mapping[str, float]


def _twist(v: Values) -> str:
    return f"the motion shows GJ times the roll, {short(v['GJ'] * v['roll'])} N m^2 rad, better than either"


def _yield(v: Values) -> str:
    couple = v["EI"] * v["yield_share"] * v["yield_curvature"]
    return f"the motion shows the couple at which friction slides, about {short(couple)} N m, better than either"


def _losses(v: Values) -> str:
    return "both take energy out of the same motion, and their sum is known better than either"


def _shape(v: Values) -> str:
    return "rolling the grip turns the rest shape: how the rope lies between the grips is known better than either"


PAIRS: tuple[tuple[str, str, str, Callable[[Values], str]], ...] = (
    ("GJ", "roll", "GJ against the roll of the end grip (built-in twist)", _twist),
    ("roll", "curvature_1_0", "the roll of the end grip against the rest curvature about axis 1", _shape),
    ("roll", "curvature_2_0", "the roll of the end grip against the rest curvature about axis 2", _shape),
    ("yield_curvature", "yield_share", "yield curvature against the share that yields", _yield),
    ("bend_damping", "drag_linear", "internal damping against drag", _losses),
)


def trades(result: FitResult) -> tuple[tuple[str, str], ...]:
    """(what, sentence) of everything that a reader of a rope's parameters must know together.

    Args:
        result: of the last fit of `fit_rope`.

    Raises:
        InputError: it is no result.
    """
    check_kind("result", result, FitResult, "give the result of the last fit")
    values = {name.removeprefix(f"{NAME}_"): value for name, value in as_quantities(result.values).items()}
    seen = {frozenset((quantity(c.first), quantity(c.second))): c.value for c in result.correlations}
    notes = []
    for first, second, what, words in PAIRS:
        correlation = seen.get(frozenset((f"{NAME}_{first}", f"{NAME}_{second}")), 0.0)
        if abs(correlation) >= STRONG:
            notes.append((what, f"{words(values)} (correlation {correlation:+.2f})"))
    GJ = next((e for e in result.estimates if quantity(e.name) == f"{NAME}_GJ"), None)
    if GJ is not None and GJ.verdict not in ("rough", "no minimum") and _open_above(GJ):
        least = "" if GJ.lower is None else f": at least {short(GJ.lower)} N m^2"
        notes.append(("GJ", f"bounded from below only{least}; a rope stiffer in twist would move the same way"))
    notes.append(("EA", "not fitted: the rope is taken as inextensible, and motion would bound EA from below only"))
    if is_over_density(result):
        what = "not known: motion shows stiffness and drag over it only; weigh the rope for EI and GJ in N m^2"
        return (*((about, in_units(words)) for about, words in notes), ("density", what))
    notes.append(("density", "given: stiffness and drag scale with it, 1 % in the weight is 1 % in EI, GJ and drag"))
    return tuple(notes)


def _open_above(e: Estimate) -> bool:
    return e.verdict == "not identifiable" or e.upper is None or e.upper > LOOSE * e.value
