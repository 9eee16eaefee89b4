"""Reference gradients of the workloads by complex step."""

from __future__ import annotations

import json
from importlib.resources import files

import numpy as np

from .problem import Gradient, Problem
from .workloads import WORKLOADS, Array, direction


def reference(problem: Problem) -> dict[int, Array]:
    """Scene -> its four numbers: by stretch and bend compliance, mass, and along the direction of the start.

    Those of the whole workloads come with the package; for shortened ones the core takes complex steps here and now.
    """
    w = problem.workload
    if w == WORKLOADS.get(w.name):
        return shipped(w.name)
    return {scene: problem.complex_step(scene) for scene in w.checked}


def shipped(name: str) -> dict[int, Array]:
    """Of a whole workload, made by experiments/bench/plain.cpp, which shares no code with the package."""
    known = json.loads(files(__package__).joinpath("reference.json").read_text())["gradients"][name]
    return {int(scene): np.array(numbers) for scene, numbers in known.items()}


def largest_error(problem: Problem, found: Gradient) -> float:
    """Largest relative error of the four numbers over the scenes that have a reference."""
    numbers = found.numbers(direction(problem.workload))
    return max(float(np.max(np.abs(numbers[k] / wanted - 1))) for k, wanted in reference(problem).items())
