"""From all tests of one fabric to its numbers: the law that the pulls support, where to begin, what stays open."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..arrays.checks import check_each, check_kind, is_number
from ..errors import InputError
from ..objects.fabric import Fabric
from ..objects.laws import Exponential, Law, Linear, Sinh
from ..problem.linear_algebra import one_blas_thread
from .curve import Curve
from .fabric_fit import FabricFit, Measured, fit_fabric
from .pull import first_guess, mean_loads, pulled
from .strip_fit import Levels, weigh
from .strip_laws import STRIP_LAWS

SIMULATED = tuple(name for name, law in STRIP_LAWS.items() if law.simulated)
STRAIGHT = 0.01
"""Stiffening of a direction of which no pull tells any: as good as none."""

_BENDING = 2e-5  # N m, to begin with where only a drape tells it
_LEVELS = 5


@dataclass(frozen=True, kw_only=True)
class FabricTests:
    """All that was measured of one fabric.

    Attributes:
        pulls: curves of tension by direction, "warp" and "weft".
        readings: of all other tests, by the number of the fabric that each is made for ("density", "shear", "bending",
            "bending_weft"); "drape" of drapes.
        given: numbers of the fabric that no test shall find.
        law: "chosen", or the name of a law that scenes have.
        way, cycle: of the pulls, see `pulled`.
    """

    pulls: Mapping[str, Sequence[Curve]]
    readings: Mapping[str, Sequence[Measured]]
    given: Mapping[str, float]
    law: str = "chosen"
    way: str = "loading"
    cycle: int = 0

    def __post_init__(self) -> None:
        for field in ("pulls", "readings", "given"):
            check_kind(field, getattr(self, field), Mapping, "give a mapping, which may be empty")
        for along, curves in self.pulls.items():
            check_each(f"pulls.{along}", curves, Curve, "give what textile.read_curves returns")
        for kind, readings in self.readings.items():
            check_each(f"readings.{kind}", readings, Measured, "give textile.Measured(...)")
        for name, value in self.given.items():
            if not is_number(value):
                raise InputError(f"given.{name}", "must be a number", value, "give it in SI units")


@dataclass(frozen=True)
class WholeFabric:
    """Result of `fit_tests`.

    Attributes:
        fit: numbers with intervals, and each reading beside the fabric's.
        law: its name.
        reasons: sentences: why this law, and what each number that no test tells was taken as.
    """

    fit: FabricFit
    law: str
    reasons: tuple[str, ...]


@one_blas_thread()
def fit_tests(tests: FabricTests) -> WholeFabric:
    """Find one fabric from all of its tests together.

    Raises:
        InputError: a number that no test tells and that is not given, or an unknown law.
        NoEquilibriumError: a test of the first guess comes to no rest.
        MissingExtraError: scipy is not installed.
    """
    check_kind("tests", tests, FabricTests, "give textile.FabricTests(...)")
    _expect_known(tests)
    law, why = supported_law(tests)
    measured = [m for along, c in tests.pulls.items() for m in pulled(c, along, tests.way, cycle=tests.cycle)]
    flat = [m for kind, readings in tests.readings.items() if kind != "drape" for m in readings]
    start, free = _start(tests, law)
    taken = _taken(tests, start)
    drapes = list(tests.readings.get("drape", ()))
    if drapes and measured + flat:  # a drape far from the fabric's own has no state of as many folds
        known = [n for n in free if n != "bending" or "bending" in tests.readings]
        if known:
            start = fit_fabric([*measured, *flat], start, known).fabric
    return WholeFabric(fit_fabric([*measured, *flat, *drapes], start, free), law, (why, *taken))


def supported_law(tests: FabricTests) -> tuple[str, str]:
    """The law that scenes have which the pulls of all directions together support most, and a sentence on it."""
    if tests.law != "chosen":
        if tests.law not in SIMULATED:
            raise InputError(
                "law", "is none that scenes have", tests.law, f"use one of: chosen, {', '.join(SIMULATED)}"
            )
        return tests.law, f"the law is {tests.law}, as given"
    if not tests.pulls:
        return "linear", "the law is linear: there are no pulls to choose by"
    logs, locks = dict.fromkeys(SIMULATED, 0.0), []
    for along, curves in tests.pulls.items():
        shares = weigh(Levels.of(curves, tests.way, tests.cycle, None), tuple(STRIP_LAWS)).shares
        for name in SIMULATED:
            logs[name] += math.log(max(shares[name], 1e-300))
        best = max(shares, key=lambda name: shares[name])
        if best not in SIMULATED:
            locks.append(f"{along} {shares[best]:.0%} for {best} ({STRIP_LAWS[best].words})")
    odds = {name: math.exp(log - max(logs.values())) for name, log in logs.items()}
    total = sum(odds.values())
    chosen_law = max(odds, key=lambda name: odds[name])
    told = ", ".join(f"{name} {odd / total:.0%}" for name, odd in sorted(odds.items(), key=lambda o: -o[1]))
    why = f"the law is {chosen_law}, which the pulls support most among those that scenes have ({told})"
    if locks:
        why += f"; a law that locks, which no scene has, would follow them better: {', '.join(locks)}"
    return chosen_law, why


def _expect_known(tests: FabricTests) -> None:
    """Check that each number that a fabric must have is measured or given."""
    told = {*tests.pulls, *tests.readings, *tests.given}
    sources = {
        "density": "weigh specimens ([weight])",
        "warp": "pull strips along the warp ([[pull]])",
        "shear": "test shear ([[shear]]), or pull strips at 45 degrees ([[pull]] with along = 'bias')",
        "bending": "test bending along the warp ([[bending]]), or a drape ([[drape]])",
    }
    if "drape" in told:
        told.add("bending")
    for name, fix in sources.items():
        if name not in told:
            raise InputError(name, "is told by no test", sorted(told), f"{fix}, or give {name} under [given]")
    both = sorted({*tests.pulls, *tests.readings} & {*tests.given})
    if both:
        raise InputError(f"given.{both[0]}", "is measured too", tests.given[both[0]], "leave it out, or leave the test")


def _start(tests: FabricTests, law: str) -> tuple[Fabric, list[str]]:
    """The fabric at which the fit begins, and the numbers that are free."""
    free: list[str] = []
    sizes: dict[str, Any] = dict(tests.given)
    laws: dict[str, Law] = {}
    for along, curves in tests.pulls.items():
        loads = mean_loads(curves, tests.cycle, tests.way, _LEVELS)
        strains = [m.value / 100.0 for m in pulled(curves, along, tests.way, cycle=tests.cycle, levels=_LEVELS)]
        sizes[along], guesses = first_guess(loads - curves[0].pretension, np.array(strains))
        laws[along] = guesses[law]
        free += [along] if law == "linear" else [along, f"{along}_stiffening"]
    kept: dict[str, float] = {"density": 0.15, "shear": 0.02 * sizes["warp"], "bending": _BENDING}
    for name, size in kept.items():
        if name in tests.readings or (name == "bending" and name not in sizes):
            sizes[name] = size
            free.append(name)
    if "density" in tests.readings:
        sizes["density"] = tests.readings["density"][0].value * 1e-3
    if "bending_weft" in tests.readings:
        sizes["bending_weft"] = sizes["bending"]
        free.append("bending_weft")
    b = {c: getattr(laws[c], c) if c in laws and law != "linear" else STRAIGHT for c in ("warp", "weft", "shear")}
    if "weft" not in sizes:
        b["weft"] = b["warp"]
    kinds: dict[str, Law] = {"linear": Linear(), "exponential": Exponential(**b), "sinh": Sinh(**b)}
    return Fabric(law=kinds[law], **sizes), free


def _taken(tests: FabricTests, start: Fabric) -> list[str]:
    """What was taken for each number that nothing tells."""
    told = {*tests.pulls, *tests.readings, *tests.given}
    found = [f"{name} was given as {value:.6g}" for name, value in tests.given.items()]
    if "weft" not in told:
        found.append("no test pulls along the weft: it is taken to be as stiff as the warp")
    if "bending_weft" not in told:
        found.append("no test bends the weft: it is taken to be as stiff as the warp")
    if "bending_twist" not in told:
        found.append("no test twists the fabric: its rigidity against twist is taken to be that of the warp")
    if "poisson" not in told:
        found.append("no test tells how warp and weft are coupled: poisson is taken as 0")
    if not isinstance(start.law, Linear):
        found.append("shear is taken to be linear")
    return found
