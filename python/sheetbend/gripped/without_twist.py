"""The comparison without twist: what a rope that bends, but does not resist torsion, explains."""

from __future__ import annotations

from ..quantities.parameters import Parameter
from .ladder import TWIST, Rung
from .model import NAME

RATIO = 0.01  # GJ/EI that counts as none: thrice as much moves errors by 3 %, a tenth lets motions diverge
EI, GJ, ROLL = (f"{NAME}_{quantity}" for quantity in ("EI", "GJ", "roll"))

WITHOUT_TWIST = Rung(
    "straight, without twist",
    parameters=(
        *(p for p in TWIST.parameters if p.name not in (GJ, ROLL)),
        Parameter(name=GJ, tied_to=EI, factor=RATIO, unit="N m^2"),
    ),
)
"""The first rung with GJ negligible; without torsion a built-in twist does nothing, so no roll is fitted."""
