"""Fits, scenes and forked processes beside each other have the bits of one after the other."""

from __future__ import annotations

import multiprocessing
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import Any

import numpy as np
import pytest
import sheetbend as sb
from sheetbend.minimum.by_ceres import has_ceres
from test_journal import WANTED, bits, swinging

FORK = multiprocessing.get_context("fork")
OPTIMIZERS = ["scipy", *(["ceres"] if has_ceres() else [])]


def fitted(experiment: sb.Experiment, optimizer: str) -> str:
    return bits(sb.fit(experiment, parameters=WANTED, optimizer=optimizer, profiles=False, beginnings=False))


@pytest.mark.parametrize("shared", [False, True], ids=["own experiments", "one experiment"])
def test_fits_in_threads(shared: bool) -> None:
    experiments = [swinging(0 if shared else seed) for seed in range(2)]
    given = [(experiments[0 if shared else k], name) for k in range(2) for name in OPTIMIZERS]
    alone = [fitted(*one) for one in given]
    with ThreadPoolExecutor(len(given)) as pool:
        assert list(pool.map(lambda one: fitted(*one), given)) == alone


def test_a_scene_is_compiled_and_used_by_threads() -> None:
    """Its first use comes from several at once, each with values of its own."""
    times, solver = [0.0, 0.1], sb.Solver(h=1 / 400)
    for _ in range(20):
        scene = swinging().scene
        values = [{"rope_EI": EI} for EI in (1e-3, 2e-3, 1e-3, 2e-3)]
        run = partial(sb.simulate, scene, times, solver)
        with ThreadPoolExecutor(len(values)) as pool:
            found = [motion.positions for motion in pool.map(run, values)]
        assert np.array_equal(found[0], found[2]) and np.array_equal(found[1], found[3])
        assert not np.array_equal(found[0], found[1])


def test_forked_processes_after_use_with_threads() -> None:
    """Threads of the pool do not live in a forked process, where the same work must not wait for them."""
    cloth = sb.cloth(
        sb.mesh.grid(0.5, 0.5, 20, 20, pattern="one_way"), density=0.2, warp=40.0, shear=5.0, bending=1e-4, pinned=[0]
    )
    solver = sb.Solver(h=1e-3, method="gauss_seidel", threads=2, grain=16)
    work = partial(sb.simulate, cloth, [0.0, 0.01], solver)
    expected = work().positions

    def child(sends: Any) -> None:
        sends.send(np.array_equal(work().positions, expected))

    receives, sends = FORK.Pipe(duplex=False)
    process = FORK.Process(target=child, args=(sends,))
    process.start()
    try:
        assert receives.poll(60.0) and receives.recv()
    finally:
        process.kill()
        process.join()
