"""What the solver itself makes up: damping by the integrator, compliance by unconverged sweeps. A fit at such a floor
shows no material."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace

from ..experiment.experiment import Experiment
from ..minimum.time_step import SWEEPS
from ..quantities.parameters import Parameters
from ..quantities.wording import short
from ..result.estimate import Estimate
from ..result.result import Refit
from ..statistics.identifiability import Identifiability
from ..statistics.judge import Floor


def solver_floors(experiments: Sequence[Experiment], parameters: Parameters) -> dict[str, Floor]:
    """Floors of the free parameters, by (expanded) name.

    BDF1 damps a mode of frequency omega like zeta = omega h / 2, a Kelvin-Voigt time constant tau like omega tau / 2:
    the floor is tau = h, that of a loss factor omega h.
    Gauss-Seidel leaves about 0.9 h^2 / (m sweeps) of compliance in a link of node mass m: EA above length / that is
    not seen, and no membrane stiffness above its inverse.
    """
    floors: dict[str, Floor] = {}
    for name in parameters.free:
        quantity = name.partition("[")[0]
        for e in experiments:
            if e.static or quantity not in e.scene.quantities:
                continue
            h, sweeps = e.solver.h, e.solver.sweeps
            if quantity.endswith("_damping") and parameters[name].unit == "s" and e.solver.integrator == "bdf1":
                floors[name] = Floor(h, f"BDF1 with a substep of {h:g} s damps as much by itself; use bdf2")
            if quantity.endswith("_loss_factor") and e.solver.integrator == "bdf1":
                frequency = e.scene.quantities[quantity.replace("_loss_factor", "_loss_frequency")].value
                words = f"BDF1 with a substep of {h:g} s damps as much by itself; use bdf2"
                floors[name] = Floor(2.0 * math.pi * frequency * h, words)
            sheet = next((c for c in e.scene.cloths.values() if quantity in membrane_names(c.fabric)), None)
            if sheet is not None and e.solver.method == "gauss_seidel":
                mass = (
                    e.scene.quantities[f"{sheet.fabric}_density"].value * sheet.mesh.areas.sum() / len(sheet.particles)
                )
                floors[name] = _hidden(mass * sweeps / (0.9 * h * h), sweeps, h, "newton")
            rope = next((r for r in e.scene.ropes.values() if quantity == f"{r.name}_EA"), None)
            if rope is not None and e.solver.method == "gauss_seidel":
                link = rope.arc_length[1] - rope.arc_length[0]
                mass = e.scene.quantities[f"{rope.name}_density"].value * link
                floors[name] = _hidden(link * mass * sweeps / (0.9 * h * h), sweeps, h, "direct")
    return floors


def at_floor_of_sweeps(judged: Identifiability, refits: Iterable[Refit]) -> Identifiability:
    """Estimates that twice as many sweeps would move by more than their interval are at the floor of the solver."""
    estimates = judged.estimates
    for made in refits:
        if made.name == SWEEPS:
            estimates = tuple(_swept(e, made) for e in estimates)
    return replace(judged, estimates=estimates)


def _swept(e: Estimate, made: Refit) -> Estimate:
    by = made.to_limit * made.moved[e.name]
    if e.statistical is None or abs(by) <= e.statistical:
        return e
    words = (
        f"the sweeps of the solver have not converged: twice as many would move it by {short(made.moved[e.name])} "
        f"{e.unit}; use method = 'newton' or 'direct', more sweeps or shorter substeps"
    )
    return replace(e, verdict="at its floor", words=words)


def membrane_names(fabric: str) -> tuple[str, str, str]:
    """The quantities of a fabric's membrane, N/m."""
    return f"{fabric}_warp", f"{fabric}_weft", f"{fabric}_shear"


def _hidden(limit: float, sweeps: int, h: float, method: str) -> Floor:
    fix = f"use method = '{method}' or shorter substeps"
    return Floor(limit, f"{sweeps} Gauss-Seidel sweeps at {h:g} s hide any larger stiffness; {fix}", ceiling=True)
