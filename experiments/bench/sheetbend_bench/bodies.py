"""A chain of hinged bodies on the direct solver, beside a rope of as many segments (the ropes of `chain`).

Both hang from one end, with BDF2 and two Newton iterations per substep. A body has six rigid rows and five of its
hinge; the hinges turn about y and z in turn. A unit of work is one body, or one segment, in one substep. The loss is
the sum of the last coordinates.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from sheetbend.motion.solver import Solver
from sheetbend.objects.joints import hinge
from sheetbend.scene.scene import Scene
from sheetbend.version import __version__

from .chain import BOUND, H, Length, chains, lengths
from .machine import isa, machine
from .measurement import LANES
from .ropes import Ropes
from .timing import in_fresh_process, peak_mb, timed

BODIES = (20, 100, 300, 1000)
WORK = 20_000  # bodies times substeps of one run
CHECKED = (10, 30)  # bodies and substeps of the chain whose gradient is compared with a complex step


def hinged(length: Length, threads: int) -> Ropes:
    """Bodies of 1 m together, each a homogeneous box."""
    scene, upper, side = Scene("hinged bodies"), None, 1.0 / length.segments
    for k in range(length.segments):
        mass = 0.05 * side
        body = scene.add_body(f"b{k}", mass=mass, inertia=[mass * side**2 / 6] * 3, at=(side * (k + 0.5), 0, 0))
        hinge(upper, body, at=(side * k, 0, 0), axis=(0, 1 - k % 2, k % 2), name=f"h{k}")
        upper = body
    compiled = scene.compiled
    return Ropes(compiled, compiled.inputs()[None], Solver(h=H, threads=threads), length.substeps)


def measure_bodies(
    threads: int = 1, repeats: int = 5, work: int = WORK, bodies: Sequence[int] = BODIES
) -> dict[str, Any]:
    """Rows of ns per body and substep, and of ns per segment of a rope that is measured right before."""
    rows = [_row(length, threads, repeats) for length in lengths(work, bodies)]
    longest = rows[-1]
    return {
        "workload": "bodies",
        "particles": 4 * longest["bodies"],
        "projections": longest["bodies"] * longest["substeps"],
        **longest,
        "threads": threads,
        "lanes": LANES,
        "isa": isa(),
        "repeats": repeats,
        "rows": rows,
        "gradient_error": gradient_error(),
        "gradient_error_bound": BOUND,
        "peak_mb": in_fresh_process(_peak_mb, lengths(work, bodies)[-1], threads),
        "sheetbend": __version__,
        "machine": machine(),
    }


def gradient_error() -> float:
    """Of the adjoint on a short chain, relative to complex step."""
    return hinged(Length(*CHECKED), 1).gradient_error()


def _row(length: Length, threads: int, repeats: int) -> dict[str, float]:
    found: dict[str, float] = {"bodies": length.segments, "substeps": length.substeps}
    for prefix, made in (("segment_", chains(length, threads)), ("", hinged(length, threads))):
        for name, run in (("forward", made.forward), ("gradient", made.gradient)):
            times, _ = timed(run, repeats)
            found |= times.figures(f"{prefix}{name}", length.work)
    return found


def _peak_mb(length: Length, threads: int) -> float:
    return peak_mb(hinged(length, threads).gradient)
