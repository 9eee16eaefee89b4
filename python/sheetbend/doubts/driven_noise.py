"""What the noise of driven markers did to a fit that took their recorded motion for the truth.

Their noise n moves the compared markers by A n, which is in the residuals r. How far that moves the estimates from one
recording to the next is in their intervals (`driven_errors`). Besides, the expected cost holds half the expectation of
|A n|^2 beside what the parameters u are to explain, and its minimum is where both together are least: to first order it
is off by -(J'J)^-1 times the gradient with respect to u of half that expectation (errors in variables; Fuller 1987,
Measurement Error Models, chapter 3). A few random directions stand for the expectation.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..arrays.types import Array
from ..problem.problem import FitProblem
from ..quantities.wording import several, short
from ..result.estimate import Estimate
from ..statistics.gauge import RANK_TOLERANCE
from ..statistics.identifiability import Identifiability
from ..statistics.intervals import reach_of
from .driven_errors import DIRECTIONS, DrivenErrors, drawn_noise

UNFELT = 1e-9  # of the largest column of J: a parameter that moves less is not drawn off
HARMLESS = 0.25  # of the residual: then a sixteenth of its variance is the driven markers'
DISHONEST = 1.5  # times what a sigma says
OFF = 0.5  # half-widths, by which an estimate must be drawn off to be doubtful


@dataclass(frozen=True)
class DrivenNoise:
    """What driven markers do to one experiment, root mean squares of one coordinate.

    Attributes:
        experiment: its name.
        noise: m, of its driven markers, as the recording shows it.
        moved: by which such noise moves a compared marker, m, or what a force sensor reads, N.
        residual: of these, in the same unit.
        sensor: name of the force sensor; empty for the markers.
        follows: whether the scene follows markers, so that `driven_sigma` can correct them.
    """

    experiment: str
    noise: float
    moved: float
    residual: float
    sensor: str = ""
    follows: bool = True

    @property
    def harms(self) -> bool:
        """Whether it makes up a part of the residuals that counts."""
        return self.moved > HARMLESS * self.residual


def driven_noises(problem: FitProblem, u: Array) -> tuple[tuple[DrivenNoise, ...], dict[str, float]]:
    """What the noise of driven markers does at the minimum u (free,), where no correction allows for it.

    Returns:
        Of every experiment that noisy motion drives; and by how much all of them together are expected to have moved
        each free parameter, in internal coordinates, where one of them harms.
    """
    drawn = drawn_noise(problem, u, DIRECTIONS)
    if drawn is None:
        return (), {}
    rows, layout = problem.core.first_rows, problem.rows_layout()
    found: list[DrivenNoise] = []
    _, r, J = problem.evaluate(u)
    for i, moved in drawn.moved.items():
        e, left = problem.experiments[i], r[rows[i] : rows[i + 1]]
        clock, channel = layout.clocks[layout.recording == i], layout.channel[layout.recording == i]
        parts = [("", e.sigma, clock == 0)]
        parts += [(s.name, s.sigma, (clock == k) & (channel < 3)) for k, s in enumerate(e.forces, start=1)]
        follows = bool(e.scene.boundary.following)
        found += [
            DrivenNoise(e.name, drawn.size[i], sigma * _rms(moved[:, part]), sigma * _rms(left[part]), sensor, follows)
            for sensor, sigma, part in parts
            if part.any()
        ]
    return tuple(found), _drawn_off(problem, u, J, drawn) if any(one.harms for one in found) else {}


def _drawn_off(problem: FitProblem, u: Array, J: Array, drawn: DrivenErrors) -> dict[str, float]:
    length = np.linalg.norm(J, axis=0)
    felt = length > UNFELT * length.max()
    size = np.where(felt, length, 1.0)
    slope = np.where(felt, drawn.slope(u, J), 0.0) / size  # by u times its size
    normal = (J / size).T @ (J / size)
    off = -0.5 * np.linalg.pinv(normal, rcond=RANK_TOLERANCE, hermitian=True) @ slope / size
    return dict(zip(problem.parameters.free, off.tolist(), strict=True))


def driven_doubts(problem: FitProblem, u: Array, judged: Identifiability) -> tuple[tuple[str, ...], dict[str, str]]:
    """What a reader must know of driven markers.

    Returns:
        Warnings: `driven_noises` in words where they harm, the worst with the names of the others, and where a
        correction and its prior disagree. And by parameter, that noise draws the fit off by more than its interval
        allows for.
    """
    found, off = driven_noises(problem, u)
    harm = [one for one in found if one.harms]
    worst = max(harm, key=_share, default=None)
    doubted = {} if worst is None else _doubted(problem, worst, off, judged.estimates)
    wide = [e.name for e in judged.estimates if e.statistical is not None and e.driven > e.statistical]
    more = f", of which it is the larger part for {several(wide)}" if wide else ""
    alike: dict[str, list[DrivenNoise]] = {}
    for one in sorted(harm, key=_share, reverse=True):
        alike.setdefault(_fix(one), []).append(one)
    words = [
        f"{one.experiment}: noise of its {_what(one)} ({short(1e3 * one.noise, 2)} mm, from the recording) moves "
        f"{_moved_words(one)} (of one coordinate){_elsewhere(rest)}. The intervals count that to first order{more}: "
        f"{fix}"
        for fix, (one, *rest) in alike.items()
    ]
    return (*words, *_corrected(problem, u)), doubted


def _share(one: DrivenNoise) -> float:
    return one.moved / max(one.residual, np.finfo(float).tiny)


def _elsewhere(rest: Sequence[DrivenNoise]) -> str:
    return f"; it counts in {several([one.experiment for one in rest])} too" if rest else ""


def _doubted(problem: FitProblem, worst: DrivenNoise, off: dict[str, float], of: Sequence[Estimate]) -> dict[str, str]:
    named = {}
    for estimate in of:
        p, x = problem.parameters[estimate.name], off.get(estimate.name, 0.0)
        if abs(x) > OFF * reach_of(p, estimate):
            size = f"{short(100 * abs(np.expm1(x)), 2)} %" if p.log else f"{short(abs(x), 2)} {p.unit}".rstrip()
            named[estimate.name] = (
                f"noise of the {_what(worst)} of {worst.experiment} ({short(1e3 * worst.noise, 2)} mm) biases the fit: "
                f"this value is some {size} too {'high' if x > 0 else 'low'}, to first order. Fix: {_fix(worst)}"
            )
    return named


def _what(one: DrivenNoise) -> str:
    return "driven markers" if one.follows else "driven motion"


def _fix(one: DrivenNoise) -> str:
    if one.sensor:
        return "drive the grips by smoother poses, or leave the forces out"
    if one.follows:
        return "set driven_sigma, which estimates the true motion and makes intervals narrower"
    return "hold the grip's pose by more markers farther apart, or follow a marker with driven_sigma"


def _moved_words(one: DrivenNoise) -> str:
    if one.sensor:
        return f"what {one.sensor} reads by {short(one.moved, 2)} N; the residual is {short(one.residual, 2)} N"
    return f"the compared ones by {short(1e3 * one.moved, 2)} mm; the residual is {short(1e3 * one.residual, 2)} mm"


def _corrected(problem: FitProblem, u: Array) -> list[str]:
    words = []
    _, r, _ = problem.evaluate(u)
    found, rows = problem.corrections(u), problem.core.first_rows
    for i, e in enumerate(problem.experiments):
        if e.name not in found or e.driven_noise is None:
            continue
        residual, by = _rms(r[rows[i] : rows[i + 1]]), _rms(found[e.name])
        if not 1 / DISHONEST < residual < DISHONEST:
            seen, said = short(1e3 * e.sigma * residual, 2), short(1e3 * e.sigma, 2)
            words.append(
                f"{e.name}: residuals of {seen} mm (of one coordinate) contradict a sigma of {said} mm. The fit weighs "
                "driven_sigma against sigma: set sigma to the size of the residuals"
            )
        told = e.driven_noise * float(np.sqrt(problem.core.absorbed(i) / found[e.name].size))  # the rest stays zero
        if by > DISHONEST * told:
            words.append(
                f"{e.name}: the fit corrected driven markers by {short(1e3 * by, 2)} mm, but a driven_sigma of "
                f"{short(1e3 * e.driven_noise, 2)} mm implies {short(1e3 * told, 2)} mm: raise driven_sigma, or doubt "
                "the model"
            )
    return words


def _rms(a: Array) -> float:
    return float(np.sqrt(np.mean(a**2)))
