"""Optimizers that stopped before their end, near it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import sheetbend as sb
from sheetbend.minimum.search import Found, Search
from sheetbend.problem.problem import FitProblem

SIGMA, SOLVER, AT = 3e-4, sb.Solver(h=1 / 400), [2, 4, 6, 8]


def falling() -> sb.Experiment:
    times = np.arange(151) / 100
    scene = sb.rope(0.5, 8, density=0.05, EI=2e-3, bend_damping=0.01, drag_linear=5e-3, clamp_start=(1, 0, 0))
    x = sb.simulate(scene, times, SOLVER).positions[:, AT]
    x = x + SIGMA * np.random.default_rng(0).standard_normal(x.shape)
    recording = sb.Recording(positions=x, times=times, name="fall")
    return sb.Experiment(
        scene=scene, recording=recording, markers=[sb.on_particle(i) for i in AT], solver=SOLVER, sigma=SIGMA
    )


def stopped(monkeypatch: pytest.MonkeyPatch, off: float, interrupted: bool = False) -> sb.Fit:
    """A fit whose optimizer stopped a number of half-widths (0.016 %) of EI above its minimum."""
    run = Search.run

    def short(self: Search, problem: FitProblem) -> Found:
        found = run(self, problem)
        u = found.ends[0].u + np.array([1.6e-4 * off, 0.0])
        end = replace(
            found.ends[0],
            u=u,
            cost=problem.cost(u),
            converged=False,
            interrupted=interrupted,
            message="Maximum number of iterations reached.",
        )
        return replace(found, ends=(end,), interrupted=interrupted)

    monkeypatch.setattr(Search, "run", short)
    return sb.fit(falling(), parameters=["rope_EI", "rope_drag_linear"], profiles=False, beginnings=False)


@pytest.mark.parametrize("interrupted", [False, True])
def test_where_the_next_step_moves_a_good_part_of_a_half_width_is_doubtful(
    monkeypatch: pytest.MonkeyPatch, interrupted: bool
) -> None:
    """EI was "identified" half a half-width off, as 0.1 % of the cost of 1,812 residuals is much."""
    found = stopped(monkeypatch, 0.5, interrupted)
    EI = found["rope_EI"]
    assert EI.verdict == "doubtful" and "next step would move it by 0.49 half-widths" in EI.words
    assert ("was interrupted" if interrupted else "Maximum number of iterations") in EI.words
    assert not found.result.converged and not found.result.sound


def test_where_it_moves_little_a_warning_says_how_much(monkeypatch: pytest.MonkeyPatch) -> None:
    found = stopped(monkeypatch, 0.05)
    assert found["rope_EI"].verdict == "identified"
    (warning,) = [w for w in found.result.warnings if "did not converge" in w]
    assert "the next step would move no parameter by more than 0.049 half-widths (rope_EI)" in warning


def test_a_minimum_that_was_reached_is_not_asked() -> None:
    result = sb.fit(falling(), parameters=["rope_EI"], profiles=False, beginnings=False).result
    assert result["rope_EI"].verdict == "identified" and not any("next step" in w for w in result.warnings)
