"""Rows of a fit's result, from what the fit found."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from ..doubts.prediction import Comparison
from ..minimum.growth import Growth
from ..minimum.progress import Minimum
from ..minimum.race import Raced
from ..quantities.parameters import Parameters
from ..result.estimate import Given, ProfileCurve
from ..result.motions import MotionGrowth, RecordingFit
from ..result.result import Start
from ..statistics.profile import Profile


def recording_fit(
    c: Comparison,
    rows: Mapping[str, int],
    left_out: Mapping[str, Comparison],
    corrected: Mapping[str, np.ndarray],
    starts: Mapping[str, tuple[float, float]],
) -> RecordingFit:
    """Errors of one recording, with the correction of its driven markers and what an estimated start was moved by,
    predicted by the others where it was left out.

    Args:
        rows: number of residuals by recording.
    """
    found = _errors(c, rows.get(c.experiment.name, 0))
    if c.experiment.name in corrected:
        by = float(np.sqrt(np.mean(corrected[c.experiment.name] ** 2)))
        found = replace(found, driven_sigma=c.experiment.driven_noise, corrected_by=by)
    found = replace(found, start_moved=starts.get(c.experiment.name))
    if c.experiment.name not in left_out:
        return found
    other = _errors(left_out[c.experiment.name], 0)
    return replace(
        other,
        rows=found.rows,
        rms=found.rms,
        seen=found.seen,
        driven_sigma=found.driven_sigma,
        corrected_by=found.corrected_by,
        start_moved=found.start_moved,
    )


def _errors(c: Comparison, rows: int) -> RecordingFit:
    """Of a cloud without its motion and its frequencies: no point is followed over time."""
    found = c.errors(rows)
    if not c.experiment.is_cloud:
        return found
    return replace(found, motion=None, measured_frequency=None, simulated_frequency=None)


def growth_rows(start: Sequence[Growth], end: Sequence[Growth]) -> tuple[MotionGrowth, ...]:
    """Of every motion, where the fit started and where it ended."""
    return tuple(
        MotionGrowth(
            name=first.name,
            largest=(_finite(first.largest), _finite(last.largest)),
            rate=(first.rate, last.rate),
            until=(first.until, last.until),
        )
        for first, last in zip(start, end, strict=True)
    )


def curves(profiles: Mapping[str, Profile], parameters: Parameters, u: np.ndarray) -> tuple[ProfileCurve, ...]:
    """Of every profile, around the estimate u (free,), internal, in the order of the parameters."""
    found = []
    for column, name in enumerate(parameters.free):
        if name in profiles and len(profiles[name].away) > 1:
            p, at = profiles[name], float(u[column])
            found.append(
                ProfileCurve(
                    name=name,
                    values=tuple(parameters[name].to_physical(at + t) for t in p.away),
                    rises=p.rises,
                    parabola=tuple((t / p.reach) ** 2 for t in p.away),
                )
            )
    return tuple(found)


def _finite(number: float) -> float | None:
    return number if np.isfinite(number) else None


def given_rows(parameters: Parameters, values: Mapping[str, float]) -> tuple[Given, ...]:
    """The parameters that are not fitted."""
    rows = []
    for name, p in parameters.items():
        if not p.free:
            words = (
                "fixed"
                if p.tied_to is None
                else f"{p.factor:g} times {p.tied_to}"
                if p.factor != 1.0
                else f"equal to {p.tied_to}"
            )
            rows.append(Given(name=name, value=values[name], unit=p.unit, words=words))
    return tuple(rows)


def every_end(ends: Sequence[Minimum], raced: Sequence[Raced]) -> list[tuple[Minimum, Raced | None]]:
    """One end for each start, best first: of raced starts that of the best of their group, and those that led nowhere
    last."""
    found: list[tuple[Minimum, Raced | None]] = []
    for end in ends:
        mine = sorted((r for r in raced if end.group and r.group == end.group), key=lambda r: r.cost)
        found += [(end, one) for one in mine] or [(end, None)]
    lost = [r for r in raced if not r.group]
    return found + [(Minimum(r.first, np.inf, 0, 0, False, False, r.message), r) for r in lost]


def start_rows(ends: Sequence[tuple[Minimum, Raced | None]], parameters: Parameters) -> tuple[Start, ...]:
    """From `every_end`."""
    return tuple(
        Start(
            cost=_finite(end.cost),
            iterations=end.iterations,
            converged=end.converged,
            values=parameters.to_physical(end.u),
            first={} if raced is None else parameters.to_physical(raced.first),
            raced=None if raced is None else _finite(raced.cost),
            group=None if raced is None or not raced.group else raced.group,
        )
        for end, raced in ends
    )
