"""Units as the exports of testing machines write them: "mm", "cN", "gf/cm", "N·mm/mm", "%", "cm-1"."""

from __future__ import annotations

import re
from dataclasses import dataclass
from math import pi

from ..errors import InputError
from ..files.units import METERS
from .reading import GRAM_FORCE

_INCH, _POUND = 0.0254, 4.4482216152605
_FORCES = {"N": 1.0, "mN": 1e-3, "cN": 1e-2, "daN": 10.0, "kN": 1e3, "gf": GRAM_FORCE, "kgf": 1e3 * GRAM_FORCE}
_FORCES |= {"g": GRAM_FORCE, "kg": 1e3 * GRAM_FORCE, "lbf": _POUND}  # g and kg of a force: gram-force
_LENGTHS = METERS | {"um": 1e-6, "in": _INCH, "inch": _INCH}
_TIMES = {"s": 1.0, "sec": 1.0, "sek": 1.0, "ms": 1e-3, "min": 60.0}
_ANGLES = {"deg": pi / 180.0, "°": pi / 180.0, "grad": pi / 180.0, "rad": 1.0}
_RATIOS = {"%": 1e-2, "1": 1.0, "-": 1.0}
EXAMPLES = "mm, cm, m, %, mm/mm, deg, 1/cm, N, cN, gf, N/m, cN/cm, gf/cm, gf.cm/cm, s"

_DIMENSIONS = {
    (1, 0, 0): "force",
    (0, 1, 0): "length",
    (0, 1, 1): "strain",
    (0, 0, 1): "curvature",
    (1, 0, 1): "force per width",
    (1, 1, 1): "moment per width",
    (1, 1, 0): "moment",
}


@dataclass(frozen=True)
class Unit:
    """A unit: what it measures ("length", "strain", "angle", "curvature", "force", "force per width", "moment", "moment
    per width", "time"), and how many SI units it is."""

    text: str
    dimension: str
    factor: float


def unit(text: str) -> Unit | None:
    """The unit that a text names; None where it is unknown. g and kg are taken for gram-force and kilogram-force."""
    bare = text.strip().replace("µ", "u").replace("μ", "u").replace("⁻¹", "-1").replace("·", ".").replace("*", ".")
    for dimension, table in (("time", _TIMES), ("angle", _ANGLES), ("strain", _RATIOS)):
        if bare in table:
            return Unit(text, dimension, table[bare])
    bare = re.sub(r"^([a-z]+)\^?-1$", r"1/\1", bare)
    above, slash, below = bare.partition("/")
    powers, factor = [0, 0, 0], 1.0
    for part in re.split(r"[. ]+", above):
        if part in _FORCES:
            powers[0] += 1
            factor *= _FORCES[part]
        elif part in _LENGTHS:
            powers[1] += 1
            factor *= _LENGTHS[part]
        elif part != "1" or not slash:
            return None
    if slash:
        if below not in _LENGTHS:
            return None
        powers[2] += 1
        factor /= _LENGTHS[below]
    measured = _DIMENSIONS.get((powers[0], powers[1], powers[2]))
    return None if measured is None else Unit(text, measured, factor)


def quantity(field: str, text: str, *dimensions: str) -> tuple[float, str]:
    """A number with its unit ("5 cm", "0.2N/m") in SI, and which of the dimensions it has.

    Raises:
        InputError: it is no number with a unit, or measures something else.
    """
    match = re.fullmatch(r"\s*([-+]?[\d.,]+(?:[eE][-+]?\d+)?)\s*(\S.*)", text)
    found = unit(match[2]) if match else None
    if match is None or found is None or found.dimension not in dimensions:
        example = {"length": "5cm", "force": "2N", "force per width": "10gf/cm"}.get(dimensions[0], EXAMPLES)
        raise InputError(field, f"must be a {' or '.join(dimensions)} with its unit", text, f"write it as {example}")
    try:
        return float(match[1].replace(",", ".")) * found.factor, found.dimension
    except ValueError:
        raise InputError(field, "must start with a number", text, "write it as 5cm") from None
