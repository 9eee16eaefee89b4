"""What a laboratory has measured of one fabric, as readings that `fit_fabric` takes: one function for each test."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from ..errors import InputError
from ..objects.fabric import Fabric
from .bias_extension import bias_extension
from .cantilever import cantilever
from .curve import Curve, chosen, same_test
from .drape import DrapeState, Plates, drape
from .fabric_fit import Measured
from .kes import bending_loop, shear_loop
from .outline import Outline
from .reading import GRAM_FORCE, Reading
from .shear import shear

MACHINE = 0.02
"""Of a reading: what an instrument may be off by besides the scatter of specimens, where nothing else is given."""

DRAPED = 3.0
"""Points of a drape coefficient by which stable states of one fabric differ (experiments/textile_tests)."""

_LEVELS = 3  # of a bias extension
_LARGEST_SHEAR = 0.6  # of the extension at which the yarns of a trellis would lie side by side


def weighed(values: Sequence[float]) -> Measured:
    """Weight per area, g/m^2, of some specimens."""
    return _of("weight", values, lambda f: Reading(f.density, "kg/m^2", {"cloth_density": 1.0}, "g/m^2", 1e3))


def bending_lengths(values: Sequence[float], along: str) -> Measured:
    """Bending lengths, mm, of strips along the warp or the weft (`cantilever`)."""
    return _of(f"bending length, {along}", values, lambda f: cantilever(f, along).bending_length)


def rigidities(curves: Sequence[Curve], along: str, cycle: int) -> Measured:
    """B of bending loops (`bending_loop`): the fabric's own rigidity."""
    values = [bending_loop(curve, cycle).rigidity for curve in _tests(curves, "bending")]

    def test(fabric: Fabric) -> Reading:
        own = along == "weft" and fabric.bending_weft is not None
        value = fabric.bending_weft if own and fabric.bending_weft is not None else fabric.bending
        name = "cloth_bending_weft" if own else "cloth_bending"
        return Reading(value, "N m", {name: 1.0}, values[0].laboratory_unit, values[0].per)

    return _of(f"B, {along}", [v.laboratory for v in values], test)


def shear_stiffness(values: Sequence[float] | Sequence[Curve], along: str, cycle: int) -> Measured:
    """G, gf/(cm deg), of KES shear tests: as read, or of their loops (`shear_loop`)."""
    loops = [v for v in values if isinstance(v, Curve)]
    read = [shear_loop(c, cycle).stiffness.laboratory for c in _tests(loops, "shear")] if loops else values
    return _of(f"G, {along}", read, lambda f: shear(f, along).stiffness)  # type: ignore[arg-type]


def bias_pulled(curves: Sequence[Curve], cycle: int = 0) -> list[Measured]:
    """Forces of strips cut at 45 degrees (`bias_extension`), at even shares of the extension that all reach.

    Raises:
        InputError: curves without length and width, or strips that are less than twice as long as wide.
    """
    ways = [chosen(c, cycle).loading for c in _tests(curves, "tension")]
    first = ways[0]
    if first.length is None or first.width is None:
        fix = "give length and width of the strips"
        raise InputError(first.name, "is a bias pull of unknown size", (first.length, first.width), fix)
    length, width = first.length, first.width
    locked = (np.sqrt(2.0) - 1.0) * (length - width) / length
    reach = min(*(float(w.deformation.max()) for w in ways), _LARGEST_SHEAR * locked)

    def test(strain: float) -> Callable[[Fabric], Reading]:
        return lambda f: bias_extension(f, extension=strain * length, length=length, width=width).force

    found = []
    for strain in reach * np.arange(1, _LEVELS + 1) / _LEVELS:
        forces = [w.load_at(float(strain)) * width / GRAM_FORCE for w in ways]
        found.append(_of(f"force at {100 * strain:.3g} %, bias", forces, test(float(strain)), "bias"))
    return found


def draped(outlines: Sequence[Outline], plates: Plates, error: float = DRAPED) -> Measured:
    """The drape coefficient of shadows, compared with the fabric's own state of as many folds.

    Args:
        outlines: a specimen each.
        plates: with the diameters of cloth and plates, m.
        error: points of the coefficient by which states of one fabric differ.
    """
    values = [outline.coefficient(plates["diameter"], plates["plate"]) for outline in outlines]
    specimens = {f"drape {k}": value for k, value in enumerate(values, start=1)}
    folds = _folds(outlines)
    note = f"drapes are compared with the state that a start with {folds} folds leads to; others differ by a few points"
    return Measured.of_specimens(
        specimens,
        name="drape coefficient",
        test=lambda f: as_draped(f, outlines, plates).coefficient,
        error=error,
        note=note,
    )


def as_draped(fabric: Fabric, outlines: Sequence[Outline], plates: Plates) -> DrapeState:
    """The state to which a start with as many folds as the outlines have leads."""
    return drape(fabric, folds=(_folds(outlines),), **plates).states[0]


def _folds(outlines: Sequence[Outline]) -> int:
    return round(float(np.median([outline.nodes for outline in outlines])))


def extensions(curves: Sequence[Curve], cycle: int, loads: Mapping[str, float]) -> dict[str, float | None]:
    """Mean strain at the loads, N/m, of the laboratories' numbers, None at those that a specimen did not reach."""
    ways = [chosen(c, cycle).loading for c in _tests(curves, "tension")]
    found = {name: float(np.mean([w.deformation_at(load) for w in ways])) for name, load in loads.items()}
    return {name: value if np.isfinite(value) else None for name, value in found.items()}


def _tests(curves: Sequence[Curve], test: str) -> Sequence[Curve]:
    if same_test(curves)[0].test != test:
        raise InputError("curves", f"are not tests of {test}", curves[0].test, f"read the files with test={test!r}")
    return curves


def _of(name: str, values: Sequence[float], test: Callable[[Fabric], Reading], specimens: str = "") -> Measured:
    """The mean, with the error of the instrument in parts of it. Specimens of readings with the same word are the
    same."""
    named = {f"{specimens or name} {k}": float(value) for k, value in enumerate(values, start=1)}
    return Measured.of_specimens(named, name=name, test=test, error=MACHINE * abs(float(np.mean(values))))
