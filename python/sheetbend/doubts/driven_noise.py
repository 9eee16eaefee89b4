"""What the noise of driven markers did to a fit that took their recorded motion for the truth.

Their noise n moves the compared markers by A n, which is in the residuals r. The expected cost then holds half the
expectation of |A n|^2 besides what the parameters u are to explain, and its minimum is where both together are least:
to first order it is off by -(J'J)^-1 times the gradient with respect to u of half that expectation (errors in
variables; Fuller
1987, Measurement Error Models, chapter 3). A few random directions stand for the expectation. Besides, A n differs from
one recording to the next, of which residuals tell too little.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..minimum.problem import FitProblem
from ..quantities.wording import short
from ..statistics.gauge import RANK_TOLERANCE
from ..statistics.identifiability import Identifiability

Array = np.ndarray
DIRECTIONS = 8  # of noise, which share a rollout
HARMLESS = 0.25  # of the residual: then a sixteenth of its variance is the driven markers'
DISHONEST = 1.5  # times what a sigma says
OFF = 0.5  # half-widths, by which an estimate must be off to be named


@dataclass(frozen=True)
class DrivenNoise:
    """What driven markers do to one experiment, root mean squares of one coordinate.

    Attributes:
        experiment: its name.
        noise: m, of its driven markers, as the recording shows it.
        moved: by which such noise moves a compared marker, m, or what a force sensor reads, N.
        residual: of these, in the same unit.
        sensor: name of the force sensor; empty for the markers.
    """

    experiment: str
    noise: float
    moved: float
    residual: float
    sensor: str = ""

    @property
    def harms(self) -> bool:
        """Whether the intervals are too narrow for it."""
        return self.moved > HARMLESS * self.residual


def driven_noises(problem: FitProblem, u: Array) -> tuple[tuple[DrivenNoise, ...], dict[str, float]]:
    """What the noise of driven markers does at the minimum u (free,), where no correction allows for it.

    Returns:
        Of every experiment whose scene follows noisy markers; and by how much all of them together are expected to have
        moved each free parameter, in internal coordinates, where one of them harms.
    """
    rows, layout = problem.core.first_rows, problem.rows_layout()
    found: list[DrivenNoise] = []
    _, r, J = problem.evaluate(u)
    draws: dict[int, Array] = {}
    for i, (e, recording) in enumerate(zip(problem.experiments, problem.recordings, strict=True)):
        correction = e.correction(recording)
        noise = None if correction is None or e.driven_noise is not None else e.recorded_noise()
        if correction is None or not noise:
            continue
        draws[i] = noise * np.random.default_rng(0).standard_normal((DIRECTIONS, int(np.prod(correction.shape))))
        moved, left = problem.core.respond(i, u, draws[i]), r[rows[i] : rows[i + 1]]
        clock, channel = layout.clocks[layout.recording == i], layout.channel[layout.recording == i]
        parts = [("", e.sigma, clock == 0)]
        parts += [(s.name, s.sigma, (clock == k) & (channel < 3)) for k, s in enumerate(e.forces, start=1)]
        found += [
            DrivenNoise(e.name, noise, sigma * _rms(moved[:, part]), sigma * _rms(left[part]), sensor)
            for sensor, sigma, part in parts
            if part.any()
        ]
    if not any(one.harms for one in found):
        return tuple(found), {}

    def expected(at: Array) -> float:
        return sum(float((problem.core.respond(i, at, b) ** 2).sum()) / DIRECTIONS for i, b in draws.items())

    size = np.maximum(np.linalg.norm(J, axis=0), np.finfo(float).tiny)
    here = expected(u)
    slope = np.array([expected(u + step) - here for step in np.diag(1.0 / size)])  # by u times its size
    normal = (J / size).T @ (J / size)
    off = -0.5 * np.linalg.pinv(normal, rcond=RANK_TOLERANCE, hermitian=True) @ slope / size
    return tuple(found), dict(zip(problem.parameters.free, off.tolist(), strict=True))


def doubts(problem: FitProblem, u: Array, judged: Identifiability) -> tuple[str, ...]:
    """What a reader must know of driven markers: `driven_noises` in words where they harm, and where a correction and
    its prior disagree."""
    return (*_uncorrected(problem, u, judged), *_corrected(problem, u))


def _uncorrected(problem: FitProblem, u: Array, judged: Identifiability) -> list[str]:
    found, off = driven_noises(problem, u)
    values = problem.parameters.to_physical(u)
    named = []
    for estimate in judged.estimates:
        p, x = problem.parameters[estimate.name], off.get(estimate.name, 0.0)
        by = values[estimate.name] * float(np.expm1(x)) if p.log else x
        if estimate.half_width is not None and abs(by) > OFF * estimate.half_width:
            size = f"{short(100 * abs(np.expm1(x)), 2)} %" if p.log else f"{short(abs(by), 2)} {p.unit}".rstrip()
            named.append(f"{estimate.name} by some {size} too {'high' if by > 0 else 'low'}")
    bias = f", and the fit is drawn off, {', '.join(named)} to first order" if named else ""
    return [
        f"{one.experiment}: noise of its driven markers ({short(1e3 * one.noise, 2)} mm, from the recording) moves "
        f"{_moved_words(one)} (of one coordinate). The intervals do not allow for it{bias}: "
        + ("drive the grips by smoother poses, or leave the forces out" if one.sensor else "set driven_sigma")
        for one in found
        if one.harms
    ]


def _moved_words(one: DrivenNoise) -> str:
    if one.sensor:
        return f"what {one.sensor} reads by {short(one.moved, 2)} N, beside a residual of {short(one.residual, 2)} N"
    return (
        f"the compared ones by {short(1e3 * one.moved, 2)} mm, beside a residual of {short(1e3 * one.residual, 2)} mm"
    )


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
                f"{e.name}: residuals of {seen} mm (of one coordinate) belie a sigma of {said} mm, against which "
                "driven_sigma is weighed: set sigma to what they are"
            )
        told = e.driven_noise * float(np.sqrt(problem.core.absorbed(i) / found[e.name].size))  # the rest stays zero
        if by > DISHONEST * told:
            words.append(
                f"{e.name}: driven markers had to be moved by {short(1e3 * by, 2)} mm, where a driven_sigma of "
                f"{short(1e3 * e.driven_noise, 2)} mm lets expect {short(1e3 * told, 2)}: raise it, or doubt the model"
            )
    return words


def _rms(a: Array) -> float:
    return float(np.sqrt(np.mean(a**2)))
