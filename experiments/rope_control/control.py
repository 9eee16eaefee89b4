"""Ropes controlled by gradient: a whip whose tip shall be at a point, a rod that two grippers bring into a shape,
ropes that a hand drags around a post and through a gap, and two under a bar, which two hands lift.

    python experiments/rope_control/control.py [FOLDER] [--seconds 8] [--posts 150]

It checks the gradients, reaches the targets by L-BFGS or Gauss-Newton, gives CMA-ES the same processor time (with
`pip install cma`), prints a table and writes FOLDER/control.png and FOLDER/posts.png (out/rope_control by default).
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
import sheetbend as sb
from drawn import draw
from least_squares import gauss_newton
from lift import lift
from posts import gap, wrap
from search import Search, descend, descend_again, evolve, gradient_gap
from shape import shape
from task import Task
from whip import whip

FAST = 15.0  # m/s


def solve(task: Task, seconds: float) -> list[Search]:
    """By both ways, with a report."""
    first = task.outcome(np.zeros(task.size))
    print(f"{task.name}: {task.size} unknowns; without a motion {1e3 * first.error:.0f} mm from the target")
    touches = bool(task.control.scene.contacts.contacts)  # what sticks and slips puts kinks into the cost
    descent = descend if task.residuals is None else gauss_newton
    searches = [descend_again(task, seconds, descent=descent) if touches else descend(task, seconds)]
    step = 1e-5 if touches else 1e-3
    differ = gradient_gap(task, 0.5 * searches[0].best, step=step)
    print(f"  gradient against central differences, at half the motion found: {differ:.1e} of the largest entry")
    searches += [found for found in [evolve(task, searches[0].seconds[-1])] if found]
    for search in searches:
        print(f"  {search.name}, {len(search.outcomes)} rollouts, {search.seconds[-1]:.1f} s: {told(search)}")
    if len(searches) == 1:
        print("  CMA-ES: left out, the package cma is not installed")
    return searches


def told(search: Search) -> str:
    last, count = search.outcomes[-1], search.reached_after()
    when = "not reached" if count is None else f"reached after {count} rollouts, {search.seconds[count - 1]:.2f} s"
    when += f"; {search.lost} motions could not be simulated" if search.lost else ""
    effort = float(search.best @ search.best)
    return f"{1e3 * last.error:.2f} mm, {last.speed:.3g} m/s, effort {effort:.2f}, cost {last.cost:.4f}; {when}"


def too_soon() -> None:
    """A rope without bending stiffness passes a hand's sideways motion on as a wave; the tip feels it after 0.6 s."""
    print("whip without bending, a hand that moves sideways, 0.2 s:")
    try:
        descend(whip(seconds=0.2, axes="xy", EI=None), 1.0)
    except sb.EmptyGradientError as error:
        print(f"  {error}")


def main(folder: Path, seconds: float, seconds_beside_posts: float) -> None:
    found = [(task, solve(task, seconds)) for task in (whip(), whip(FAST), shape())]
    too_soon()
    folder.mkdir(parents=True, exist_ok=True)
    draw(found, folder / "control.png")
    draw([(task, solve(task, seconds_beside_posts)) for task in (wrap(), gap())], folder / "posts.png")
    solve(lift(), seconds_beside_posts)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, nargs="?", default=Path("out/rope_control"))
    parser.add_argument("--seconds", type=float, default=8.0, help="processor time of each search at most")
    parser.add_argument("--posts", type=float, default=150.0, help="the same, of the tasks with posts")
    given = parser.parse_args()
    main(given.folder, given.seconds, given.posts)
