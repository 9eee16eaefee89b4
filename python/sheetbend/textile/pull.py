"""From measured pulls to a fabric."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from ..arrays.checks import check_count, finite, is_list, is_number
from ..errors import InputError
from ..objects.fabric import Fabric
from ..objects.laws import Exponential, Law, Linear, Sinh, Spline
from ..problem.linear_algebra import one_blas_thread
from .curve import Curve, chosen, mean_curve, same_test
from .fabric_fit import FabricFit, Measured, fit_fabric
from .flat import warp_angle
from .locking import NUMBERS, fit_locking
from .reading import Reading
from .strip_fit import Levels, weigh
from .strip_laws import STRIP_LAWS
from .uniaxial import uniaxial

LAWS = {
    "linear": (),
    "exponential": ("stiffening",),
    "sinh": ("stiffening",),
    "spline": ("ratio_1", "ratio_2", "ratio_3", "ratio_4"),
    **NUMBERS,
}
"""Numbers beside the stiffness, by the law's name; those of `locking.NUMBERS` are known to pulls alone."""

WEIGHTS = (0.0, 1.0, 2.0, 3.0)
"""Powers among which `fit_pull` chooses."""

_TAKEN = (
    "width, and strain as stretch of the fabric, are taken as exact: 1 % more width, or grips that slip by 1 % of the "
    "stretch, move a stiffness by 1 %, and no curve shows it"
)
_SPECIMEN = (0.05, 0.2)  # m, length and width of KES-FB1, where curves do not tell theirs
_LEVELS = 5
_MOST_LEVELS = 1000
_CLASS = 0.005  # class 0.5 of ISO 7500-1 and ISO 9513


def pulled(
    curves: Sequence[Curve],
    along: str = "warp",
    way: str = "loading",
    *,
    cycle: int = 0,
    levels: int = _LEVELS,
    error: float = _CLASS,
    cells: int = 6,
) -> list[Measured]:
    """What specimens stretch to under some loads, as `fit_fabric` takes it.

    The fabric is elastic and has one curve, so one way of the loop is chosen; what the loop loses is told with the
    readings. Each load is that of the mean curve at an even share of its strain, and `uniaxial` pulls such a specimen
    (the curves' width and mean length; those of KES-FB1 where they have none). A pretension counts as none: loads and
    strains are those beyond it.

    Args:
        curves: of tension, a specimen each.
        along: direction of the pull, "warp" or "weft".
        way: "loading", "unloading" or "skeleton" (their mean), see `Cycle.way`.
        cycle: which one, from 0; -1 is the last.
        levels: number of loads.
        error: of the machine, relative: what a strain may be off by besides the specimens' scatter.
        cells: of `uniaxial`.

    Raises:
        InputError: no curves, curves of another test or of different widths or pretensions, without that cycle or way,
            or slack where the first load is read off.
    """
    warp_angle(along)
    checked_pulls(curves)
    _check_error(error)
    ways = {c.name: chosen(c, cycle).way(way) for c in curves}
    length, width = _specimen(curves)
    note, found = _left_out(curves, cycle, way), []
    for load in mean_loads(curves, cycle, way, levels):
        strains = {name: 100.0 * w.deformation_at(load) for name, w in ways.items()}
        missing = [name for name, strain in strains.items() if math.isnan(strain)]
        if missing:
            fix = "cut the curves by from_pretension, or take fewer levels"
            raise InputError(missing[0], f"does not pass a load of {load:.4g} N/m", ways[missing[0]].load[0], fix)
        found.append(
            Measured.of_specimens(
                strains,
                name=f"strain at {load:.4g} N/m, {along}",
                test=_test(along, load - curves[0].pretension, width, length, cells),
                error=error * float(np.mean(list(strains.values()))),
                note=note,
            )
        )
    return found


@one_blas_thread()
def fit_pull(
    curves: Sequence[Curve],
    along: str = "warp",
    law: str | Sequence[str] = "exponential",
    *,
    weights: float | str = 0.0,
    way: str = "loading",
    cycle: int = 0,
    error: float = _CLASS,
    poisson: float = 0.0,
) -> FabricFit:
    """Stiffness and law of one direction from its pulls alone: `fit_fabric` on the readings of `pulled`, with a start
    from the mean curve.

    The other parameters of the fabric are placeholders. Of these only `poisson` matters: jaws keep a specimen from
    narrowing, and a specimen that cannot narrow at all has the stiffness warp/(1 - poisson^2). With 0 instead of 0.3
    the stiffness is 2 % too high from a strip of 20 x 5 cm, 3 % from FAST-1's 10 x 5 cm, 8 % from KES-FB1's 5 x 20 cm.
    To fit both directions and Poisson's ratio, give `fit_fabric` the readings of all tests.

    Args:
        curves, along, way, cycle, error: of `pulled`.
        law: "linear", "exponential", "sinh", "spline", or one that locks, "limit" or "two_regimes" (`strip_laws`). No
            scene has the last two: the fabric that is returned carries a spline through their fitted range. Of several
            names, or of all but "spline" where it is "chosen", the one that the pull supports most is fitted, and the
            report has the odds.
        weights: power of (largest load / load) by which a reading's sigma grows: what a law, which is not the fabric's,
            may miss at smaller loads. "chosen" takes the one of 0, 1, 2, 3 that, fitted to the lower two thirds of the
            strain, foresees the rest best.
        poisson: sqrt(nu_uv nu_vu) where it is known, as of `add_cloth`; 0 for a law that locks.

    Raises:
        InputError: an unknown law, weights or `poisson` that are none, or what `pulled` raises.
        NoEquilibriumError: the start comes to no rest.
        MissingExtraError: scipy is not installed.
    """
    if not isinstance(law, str) and not (is_list(law) and all(isinstance(name, str) for name in law)):
        raise InputError("law", "must be a name or a list of names", law, f"use some of {', '.join(LAWS)}")
    _check_error(error)
    offered = _offered(law, poisson)
    _check_options(offered, weights, poisson)
    checked_pulls(curves)
    levels, told = None, ""
    if len(offered) > 1 or weights == "chosen" or offered[0] in NUMBERS:
        levels = Levels.of(curves, way, cycle, None)
    if len(offered) > 1 and levels is not None:
        shares = weigh(levels, offered).shares
        told = "; law chosen by what the pulls support: " + ", ".join(f"{n} {s:.0%}" for n, s in shares.items())
        offered = [max(shares, key=lambda name: shares[name])]
    (name,) = offered
    if isinstance(weights, str) and levels is not None:
        errors = {power: levels.foreseen(name, power) for power in WEIGHTS}
        weights = min(errors, key=lambda power: errors[power])
        judged = ", ".join(f"{power:g} {error:.1%}" for power, error in errors.items())
        told += f"; weights chosen: power {weights:g}; error of the load from 2/3 of the strain on, by power: {judged}"
    count = max(_LEVELS, 2 * len(LAWS[name]))
    measured = pulled(curves, along, way, cycle=cycle, levels=count, error=error)
    pretension = curves[0].pretension
    loads = mean_loads(curves, cycle, way, count)
    loose = (loads[-1] / loads) ** float(weights)
    measured = [replace(m, sigma=m.sigma * x, note=m.note + told) for m, x in zip(measured, loose, strict=True)]
    loads = loads - pretension
    if name in NUMBERS and levels is not None:
        return fit_locking(name, measured, loads, levels, along, measured[0].note)
    stiffness, laws = first_guess(loads, np.array([m.value for m in measured]) / 100.0)
    sizes = {"density": 0.1, "bending": 1e-5, "warp": stiffness, "weft": stiffness, "shear": stiffness / 2.0}
    start = Fabric(**sizes, poisson=poisson, law=laws[name])
    return fit_fabric(measured, start, [along, *(f"{along}_{number}" for number in LAWS[name])])


def first_guess(loads: np.ndarray, strains: np.ndarray) -> tuple[float, dict[str, Law]]:
    """Stiffness, N/m, and every law of the simulation with numbers to begin with, the same for warp, weft and shear.

    Args:
        loads: (n,) N/m beyond the pretension, increasing.
        strains: (n,) under them.
    """
    green = strains + strains**2 / 2.0
    secants = loads / (green * (1.0 + strains))  # of a free strip: k exp(b green^2), or k sinh(b green)/(b green)
    grown = max(math.log(secants[-1] / secants[0]), 0.0)
    b = max(grown / (green[-1] ** 2 - green[0] ** 2), 0.01)
    evenly = max(math.sqrt(6.0 * grown) / green[-1], 0.01)  # where sinh(t)/t is about exp(t^2/6)
    return float(secants[0]), {
        "linear": Linear(),
        "exponential": Exponential(b, b, b),
        "sinh": Sinh(evenly, evenly, evenly),
        "spline": Spline((float(green[-1]) / 4.0,) * 3),
    }


def strains_under(
    fabric: Fabric, curves: Sequence[Curve], loads: ArrayLike, along: str = "warp", cells: int = 6
) -> np.ndarray:
    """(n,) strains that such specimens of a fabric have under loads (n,) N/m, beyond the curves' pretension as well.

    Raises:
        InputError: no curves, or curves of another test or of different widths or pretensions.
        NoEquilibriumError: a specimen comes to no rest.
    """
    checked_pulls(curves)
    length, width = _specimen(curves)
    beyond = np.atleast_1d(finite("loads", loads, None, InputError)) - curves[0].pretension
    if beyond.ndim != 1:
        raise InputError("loads", "must be a list of numbers", beyond.shape, "give N/m, one after the other")
    return np.array([_test(along, float(load), width, length, cells)(fabric).value for load in beyond])


def _offered(law: str | Sequence[str], poisson: float) -> list[str]:
    """Laws to choose among; a law that locks knows no coupling."""
    if law == "chosen":
        return [name for name in STRIP_LAWS if not (poisson and name in NUMBERS)]
    return [law] if isinstance(law, str) else list(law)


def _check_options(offered: Sequence[str], weights: float | str, poisson: float) -> None:
    unknown = [name for name in offered if name not in LAWS]
    if unknown or not offered:
        raise InputError("law", "is unknown", unknown or offered, f"use one of {', '.join(LAWS)}")
    if "spline" in offered and (len(offered) > 1 or weights == "chosen"):
        fix = "leave it out: a spline cannot foresee, so nothing can be chosen with it"
        raise InputError("law", "is a spline", list(offered), fix)
    power = is_number(weights) and 0.0 <= float(weights) <= 10.0
    if not (power or (isinstance(weights, str) and weights == "chosen")):
        raise InputError("weights", "must be a power from 0 to 10, or 'chosen'", weights, "give 0 for even weights")
    if not (is_number(poisson) and -1 < poisson < 1):
        raise InputError("poisson", "must lie between -1 and 1", poisson, "give sqrt(nu_uv nu_vu)")
    if poisson and any(name in NUMBERS for name in offered):
        raise InputError("poisson", "is of the simulation, which has no law that locks", poisson, "give 0")


def _check_error(error: float) -> None:
    if not (is_number(error) and error >= 0.0):
        raise InputError("error", "must not be negative", error, "give the machine's relative error, such as 0.005")


def _specimen(curves: Sequence[Curve]) -> tuple[float, float]:
    """Length and width, m."""
    lengths = [c.length for c in curves if c.length is not None]
    return float(np.mean(lengths)) if lengths else _SPECIMEN[0], curves[0].width or _SPECIMEN[1]


def checked_pulls(curves: Sequence[Curve]) -> None:
    """Refuse what is no set of pulls of one kind.

    Raises:
        InputError: no curves, curves of another test, of different widths or pretensions, or that share a name.
    """
    if same_test(curves)[0].test != "tension":
        raise InputError("curves", "are not pulls", curves[0].test, "give curves of tension")
    alike = sorted({f"{c.width} m, {c.pretension} N/m" for c in curves})
    if len(alike) > 1:
        fix = "fit each kind by itself, or cut them alike"
        raise InputError("curves", "have different widths or pretensions", alike, fix)
    if len({c.name for c in curves}) < len(curves):
        fix = "rename them by dataclasses.replace(curve, name=...)"
        raise InputError("curves", "share a name", [c.name for c in curves], fix)


def mean_loads(curves: Sequence[Curve], cycle: int, way: str, levels: int) -> np.ndarray:
    """(levels,) N/m of the mean curve at even shares of its strain, up to the load that all reach."""
    check_count("levels", levels, 1, _MOST_LEVELS, InputError)
    mean = mean_curve(curves, way, cycle=cycle)
    top = min(float(chosen(c, cycle).way(way).load.max()) for c in curves)
    start, end = mean.deformation[0], mean.deformation[mean.load <= top][-1]
    loads = np.interp(start + (end - start) * np.arange(1, levels + 1) / levels, mean.deformation, mean.load)
    if loads[0] <= curves[0].pretension:
        fix = "cut the slack off by from_pretension, or take fewer levels"
        raise InputError("curves", "bear nothing at the first of the levels", f"{loads[0]:.4g} N/m", fix)
    return loads


def _test(along: str, load: float, width: float, length: float, cells: int) -> Callable[[Fabric], Reading]:
    return lambda fabric: uniaxial(fabric, along, load=load, width=width, gauge=length, cells=cells).extension


def _left_out(curves: Sequence[Curve], cycle: int, way: str) -> str:
    lost = [part for part in (chosen(c, cycle).lost for c in curves) if part is not None]
    if not lost:
        return f"the curves have no unloading, so what a loop would lose is not known; {_TAKEN}"
    follows = {"skeleton": "the mean of loading and unloading"}.get(way, way)
    percent = 100.0 * float(np.mean(lost))
    loses = f"the specimens lose {percent:.0f} % of the work of loading"
    return f"{loses}; the fabric is elastic and follows {follows}; {_TAKEN}"
