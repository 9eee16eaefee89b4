"""Kills fits at random moments with SIGKILL, resumes them from their journals, and compares every bit of the results.

    python tools/kills.py [--kinds ceres scipy profiles gripped driven] [--fits 5] [--kills 3] [--seed 0]

Of each kind it runs `--fits` fits of different noise and starts, each once uninterrupted without a journal and once
killed `--kills` times. Results are compared as JSON without their times. "driven" fits correct driven markers, whose
evaluations depend on the path. Exits 1 where a result differs.
"""

from __future__ import annotations

import argparse
import importlib
import json
import multiprocessing
import os
import random
import signal
import sqlite3
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from contextlib import closing
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import numpy as np
import sheetbend as sb
from sheetbend.gripped import RopeReport, fit_rope
from sheetbend.gripped.ladder import TILTS, TWIST
from sheetbend.problem import journal

ROPES = Path(__file__).resolve().parents[1] / "experiments" / "gripped_ropes"
WANTED = ("rope_EI", "rope_bend_damping", "rope_drag_linear")


def swinging(seed: int, segments: int, seconds: float) -> sb.Experiment:
    """A rope let go from the horizontal, measured at every second node; the fit starts some times off."""
    rng = np.random.default_rng(seed)
    times = np.arange(round(100 * seconds)) / 100
    true = {"EI": 1e-3, "bend_damping": 3e-3, "drag_linear": 5e-3}
    start = {name: value * 4.0 ** rng.uniform(-1, 1) for name, value in true.items()}
    scenes = [sb.rope(0.6, segments, density=0.05, clamp_start=(1, 0, 0), **values) for values in (true, start)]
    seen = scenes[1].ropes["rope"].particles[3::2]
    exact = sb.simulate(scenes[0], times, sb.Solver(h=1 / 400)).positions[:, seen]
    recording = sb.Recording(exact + 1e-3 * rng.standard_normal(exact.shape), times)
    places = [sb.on_particle(int(p)) for p in seen]
    return sb.Experiment(scene=scenes[1], recording=recording, markers=places, solver=sb.Solver(h=1 / 400))


def driven(seed: int) -> sb.Experiment:
    """A rope that hangs from a hand, whose recorded motion is noisy too."""
    rng = np.random.default_rng(seed)
    times = np.arange(41) / 60
    rising = np.minimum(times / 0.2, 1.0)[:, None]
    hand = rising * (np.array([0.03, 0.02, 0.02]) * np.sin(2 * np.pi * np.array([1.4, 2.1, 1.1]) * times[:, None]))

    def scene(motion: np.ndarray, EI: float) -> sb.Scene:
        made = sb.Scene("rope")
        options = {"density": 0.05, "EI": EI, "bend_damping": 0.02, "drag_linear": 5e-3}
        rope = sb.add_rope(made, "rope", points=[[0, 0, 0], [0, 0, -0.4]], segments=8, **options)
        made.follow(rope.particles[:1], times, motion[:, None], ["hand"])
        return made

    exact = sb.simulate(scene(hand, 2e-3), times, sb.Solver(h=1 / 240)).positions
    positions = np.concatenate([hand[:, None], exact[:, [2, 4, 6, 8]]], axis=1)
    positions += 3e-4 * rng.standard_normal(positions.shape)
    recording = sb.Recording(positions, times, markers=("hand", "a", "b", "c", "d"))
    places = [None, *(sb.on_particle(i) for i in (2, 4, 6, 8))]
    return sb.Experiment(
        scene=scene(positions[:, 0], 2e-3 * 2.0 ** rng.uniform(-1, 1)),
        recording=recording,
        markers=places,
        solver=sb.Solver(h=1 / 240),
        sigma=3e-4,
        driven_sigma=3e-4,
    )


def gripped(seed: int, folder: Path, path: str | None) -> dict[str, Any]:
    """The recipe, two rungs of it, on a synthetic rope between two grips."""
    recordings = sb.read_recordings(folder / "rope_1" / "train")
    options: dict[str, Any] = {"windows": [(0.4, 1.2), (0.8, 2.0)], "bending_lengths": (0.25, 0.12)}
    found = fit_rope(recordings, density=0.045, ladder=[TWIST, TILTS], max_segments=24, journal=path, **options)
    return RopeReport("rope", found).to_dict()


def prepare(kind: str, seed: int, folder: Path) -> None:
    """Files that a fit reads."""
    if kind == "gripped":
        sys.path.insert(0, str(ROPES))
        script = importlib.import_module("make_data")
        script.CREEP = ((1 / 100, 10.0),)  # not quite at rest, which a fit does not need
        script.main(folder, train=2, evaluation=0, count=1, seconds=0.9, seed=seed)


def fitted(kind: str, seed: int, folder: Path, path: str | None, size: int) -> dict[str, Any]:
    """The result of one fit as JSON values; `size` makes it longer."""
    kept: dict[str, Any] = {"parameters": WANTED, "journal": path}
    if kind == "ceres":
        fit = sb.fit(swinging(seed, 12 * size, 0.6), optimizer="ceres", windows=[0.1, 0.2, 0.4], **kept)
    elif kind == "scipy":
        starts = [{"rope_EI": 1e-2}, {"rope_EI": 2e-4, "rope_bend_damping": 1e-2}]
        fit = sb.fit(swinging(seed, 12 * size, 0.4), optimizer="scipy", starts=starts, profiles=False, **kept)
    elif kind == "profiles":
        experiment = swinging(seed, 10 * size, 0.5)
        fit = sb.fit(experiment, refine=sb.Refinement(), windows=[0.2], **kept)
    elif kind == "driven":
        fit = sb.fit(driven(seed), **kept)
    else:
        return gripped(seed, folder, path)
    return fit.result.to_dict()


FORK = multiprocessing.get_context("fork")
ATTEMPTS = 12
# Optimizers choose by time how often to ask.
TIMED = ("seconds", "jacobian_seconds", "evaluations", "jacobians", "judging")


def without_times(value: Any) -> Any:
    """What must be the same bits."""
    if isinstance(value, dict):
        return {key: without_times(part) for key, part in value.items() if key not in TIMED}
    return [without_times(part) for part in value] if isinstance(value, list) else value


@dataclass(frozen=True)
class Killed:
    """How a fit went: evaluations that its journal held after each kill, and the result."""

    kept: tuple[int, ...]
    result: dict[str, Any]


class Study:
    """Runs fits in processes of their own, in one folder; they are forked from this one, which has imported everything
    and fits nothing itself."""

    def __init__(self, folder: Path, size: int = 1, say: Callable[[str], None] = print) -> None:
        self.folder, self.size, self.say = folder, size, say

    def whole(self, kind: str, seed: int) -> tuple[dict[str, Any], float]:
        """The result of an uninterrupted fit without a journal, and its seconds."""
        prepare(kind, seed, self.folder)
        return self._ended(kind, seed, None)

    def killed(self, kind: str, seed: int, kills: int, seconds: float) -> Killed:
        """The same with a journal, killed at random moments and resumed. Each time the process dies a while after it
        made its first own evaluation, in all before the `seconds` that the whole fit takes are over."""
        for _ in range(ATTEMPTS):
            if (found := self._attempt(kind, seed, kills, seconds)) is not None:
                return found
            seconds /= 2.0  # it ended before its last kill: the machine was slower before
        raise RuntimeError(f"{kind} {seed} ended before its last kill {ATTEMPTS} times")

    def _attempt(self, kind: str, seed: int, kills: int, seconds: float) -> Killed | None:
        chance = random.Random(f"{kind} {seed}")
        kept_in = self.folder / f"{kind}_{seed}.sqlite"
        kept: list[int] = []
        while len(kept) < kills:
            code, _ = self._run(kind, seed, kept_in, chance.uniform(0.05, 0.8) * seconds / kills)
            if code == 0:
                return None
            assert code == -signal.SIGKILL, code
            kept.append(evaluations(kept_in))
        result, _ = self._ended(kind, seed, kept_in)
        assert not kept_in.exists(), "a finished fit leaves no journal"
        return Killed(tuple(kept), result)

    def _run(self, kind: str, seed: int, path: Path | None, wait: float | None = None) -> tuple[int | None, str]:
        """The exit code of a fit, and what it wrote."""
        receives, sends = FORK.Pipe(duplex=False)
        given = (sends, kind, seed, self.folder, self.size, None if path is None else str(path), wait)
        process = FORK.Process(target=child, args=given)
        process.start()
        sends.close()
        try:
            told = receives.recv()
        except EOFError:  # it was killed
            told = ""
        process.join()
        return process.exitcode, told

    def _ended(self, kind: str, seed: int, path: Path | None) -> tuple[dict[str, Any], float]:
        code, told = self._run(kind, seed, path)
        assert code == 0, code
        result, seconds = json.loads(told)
        return result, seconds


def evaluations(path: Path) -> int:
    """How many a journal holds that nobody uses."""
    with closing(sqlite3.connect(path)) as opened:
        tables = opened.execute("SELECT count(*) FROM sqlite_master WHERE name = 'evaluation'").fetchone()[0]
        return int(opened.execute("SELECT count(*) FROM evaluation").fetchone()[0]) if tables else 0


def off(one: dict[str, Any], other: dict[str, Any]) -> float:
    """Largest difference of values and of ends of intervals, in half-widths."""
    largest = 0.0
    for name, a in one["parameters"].items():
        b = other["parameters"][name]
        pairs = [(a["value"], b["value"]), *zip(a["interval"], b["interval"], strict=True)]
        width = 0.5 * (a["interval"][1] - a["interval"][0])
        largest = max(largest, *(abs(x - y) / width for x, y in pairs))
    return largest


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kinds", nargs="+", default=["ceres", "scipy", "profiles", "gripped", "driven"])
    parser.add_argument("--fits", type=int, default=5)
    parser.add_argument("--kills", type=int, default=3)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--size", type=int, default=2, help="makes the ropes finer and the fits longer")
    given = parser.parse_args()
    failed = 0
    for kind in given.kinds:
        for seed in range(given.seed, given.seed + given.fits):
            with tempfile.TemporaryDirectory() as folder:
                study = Study(Path(folder), given.size)
                whole, seconds = study.whole(kind, seed)
                killed = study.killed(kind, seed, given.kills, seconds)
            same = without_times(whole) == without_times(killed.result)
            distance = 0.0 if same else off(whole, killed.result)
            failed += not same
            words = "the same bits" if same else f"{distance:.1e} half-widths off"
            print(f"{kind} {seed}: {seconds:.1f} s, kept after kills {list(killed.kept)}: {words}", flush=True)
    return 1 if failed else 0


def mortal(wait: float) -> None:
    """Let journals kill this process, `wait` s after they first kept an evaluation of their own."""

    class Mortal(journal.Journal):
        def __enter__(self) -> Mortal:
            threading.Thread(target=self._die, daemon=True).start()
            return super().__enter__()

        def _die(self) -> None:
            while not self.made:
                time.sleep(1e-3)
            time.sleep(wait)
            os.kill(os.getpid(), signal.SIGKILL)

    journal.Journal = Mortal  # type: ignore[misc]


def child(
    sends: Connection, kind: str, seed: int, folder: Path, size: int, path: str | None, wait: float | None
) -> None:
    if wait is not None:
        mortal(wait)
    began = time.perf_counter()
    result = fitted(kind, seed, folder, path, size)
    sends.send(json.dumps([result, time.perf_counter() - began]))


if __name__ == "__main__":
    sys.exit(main())
