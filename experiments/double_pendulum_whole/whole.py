"""The pendulum over all of its 69 s by multiple shooting: what the model loses, and windows that no fit saw.

    python experiments/double_pendulum_whole/whole.py

Fits double_pendulum_whole.toml four times: with every window and soft continuity, with small gaps, and as one unbroken
motion (hard continuity); then with every other window hidden, which is predicted from its first 0.1 s. Prints a table
and writes it to out/double_pendulum_whole/whole.txt; exit code 1 if a prediction is farther off than 0.008 rad.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import sheetbend as sb
from sheetbend.config import load
from sheetbend.doubts.prediction import compare, predicted_values
from sheetbend.experiment.wanted import as_parameters
from sheetbend.minimum.approach import Approach
from sheetbend.minimum.continuity import joined, shot_motions
from sheetbend.problem.problem import FitProblem
from sheetbend.quantities.parameters import Parameters
from sheetbend.result.shot import ShotMotion

CONFIG = Path(__file__).with_name("double_pendulum_whole.toml")
SMALL, UNBROKEN = 1.9e-5, 1e-7  # m/s: gaps of 0.05 mm over a window, and next to nothing
WITHIN = 0.008  # rad
SHOWN = ("upper_first_moment", "lower_first_moment", "lower_inertia", "upper_friction", "lower_friction", "lower_drag")


@dataclass(frozen=True)
class Found:
    """A fit of the whole motion: values of all parameters, what the model loses, and rms distance of the markers, m."""

    values: dict[str, float]
    shot: ShotMotion
    rms: float


def study(windows: int | None = None) -> tuple[list[sb.Experiment], Parameters]:
    """The experiments of the configuration, the fitted one first, and what is fitted; perhaps of the first windows."""
    read = load(CONFIG)
    every = list(read.experiments)
    if windows is not None:
        stop = windows * float(every[0].recording.times[-1]) / 26
        every = [replace(e, fit=(0.0, stop)) if e.predict is None else e for e in every]
        every = [e for e in every if e.held_out is None or e.held_out[1] <= stop + 0.01]
    return every, as_parameters(read.parameters, every)


def seen_whole(e: sb.Experiment) -> sb.Experiment:
    """With nothing hidden."""
    whole = sb.Recording.load(CONFIG.parents[1] / "double_pendulum/data/pendulum_double_fit.npz")
    return replace(e, recording=whole, name=e.name)


def fitted(e: sb.Experiment, parameters: Parameters, loss: float | None = None) -> Found:
    """The minimum alone; `sheetbend fit` also derives intervals and doubts, which takes as long again.

    Args:
        loss: m/s; found from the recording where it is None.
    """
    assert isinstance(e.shooting, sb.Shooting)
    e = replace(e, shooting=sb.Shooting(e.shooting.window, loss))
    (cut,), begun, _ = joined([e], parameters, 1)
    problem = FitProblem([cut], parameters, expanded=begun)
    walk = Approach(problem, problem.parameters.initial())
    while walk.step():
        pass
    (shot,) = shot_motions(problem, walk.u)
    measured, simulated = cut.fitted().positions, problem.simulate(walk.u)[0]
    rms = float(np.sqrt(np.nanmean(np.sum((measured - simulated) ** 2, axis=-1))))
    return Found(problem.parameters.to_physical(walk.u), shot, rms)


def angles(x: np.ndarray) -> np.ndarray:
    """(frames, 2) rad from markers (frames, 2, 3) on both arms."""
    arms = np.stack([x[:, 0], x[:, 1] - x[:, 0]], axis=1)
    return np.arctan2(arms[..., 0], -arms[..., 2])


def predicted(every: Sequence[sb.Experiment], parameters: Parameters, values: Mapping[str, float]) -> dict[str, float]:
    """rad, by piece: rms error of both angles beyond the first 0.1 s, to which its start is fitted."""
    complete, _, _ = predicted_values(every, parameters, values, "scipy", 1)
    found = {}
    for c in compare([e for e in every if e.predict is not None], parameters, complete):
        off = angles(c.recording.positions[c.held_out]) - angles(c.simulated[c.held_out])
        found[c.experiment.name] = float(np.sqrt(np.mean((np.mod(off + np.pi, 2 * np.pi) - np.pi) ** 2)))
    return found


def main() -> int:
    every, parameters = study()
    whole = seen_whole(every[0])
    fits = {
        "every window, soft": fitted(whole, parameters),
        "every window, gaps of 0.05 mm": fitted(whole, parameters, SMALL),
        "every window, unbroken": fitted(whole, parameters, UNBROKEN),
        "every other window, soft": fitted(every[0], parameters),
    }
    pieces = predicted(every, parameters, fits["every other window, soft"].values)
    lines = []
    for name, one in fits.items():
        shot = one.shot
        ends = "given" if shot.upper is None else f"{1e3 * (shot.lower or 0.0):.3f} to {1e3 * shot.upper:.3f}"
        lines.append(f"{name}: rms {1e3 * one.rms:.3f} mm, loses {1e3 * shot.loss:.3g} mm/s ({ends})")
        lines += [f"  {parameter} {one.values[parameter]:.6g}" for parameter in SHOWN]
    lines += ["predicted from the first 0.1 s:"] + [f"  {name} {error:.5f} rad" for name, error in pieces.items()]
    folder = Path("out/double_pendulum_whole")
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "whole.txt").write_text("\n".join(lines) + "\n")
    print("\n".join(lines))
    return 0 if max(pieces.values()) < WITHIN else 1


if __name__ == "__main__":
    sys.exit(main())
