"""What a gradient check found: a row for each quantity and input array, and the report."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from .gradient_probe import DIFFERENCES_BOUND

COMPLEX_STEP_BOUND = 1e-8
DOT_PRODUCT_BOUND = 1e-9


@dataclass(frozen=True)
class GradientRow:
    """One gradient against its references; errors are relative to the largest entry of the reference.

    Attributes:
        name: a named quantity, or an input array such as "position".
        size: entries; entries tested (large arrays are sampled).
        gradient: its largest absolute entry.
        complex_step: error against complex step through the templated solver.
        differences: error against central differences, whose own accuracy limits it.
        passed: complex step within its bound, differences within theirs, or within their noise; or nothing is felt.
        rounding: what complex step and adjoint may differ by for rounding, likewise relative.
        left_out: entries that were not tested, because they have no derivative: compliances of rigid constraints that
            follow from one another.
        noise: what differences may be off by for their own error (infinite where none could be taken).
        unfelt: moving any tested entry by its own size changes the loss by less than rounding does, or the gradient is
            no larger than what other last digits of the inputs make of it; for the adjoint and for complex step.
            Relative errors of such a gradient mean nothing.
    """

    name: str
    size: int
    gradient: float
    complex_step: float
    differences: float
    passed: bool
    unfelt: bool = False
    noise: float = 0.0
    rounding: float = 0.0
    left_out: int = 0


@dataclass(frozen=True)
class GradientReport:
    """The result of `check_gradients`.

    Attributes:
        scene, steps: its name, and the substeps of the stretch.
        rows: one per quantity and array.
        dot_product: relative gap of <J v, w> = <v, J^T w> for random v, w.
        sampled: what was left out to keep to a time limit, in words; empty where nothing was.
    """

    scene: str
    steps: int
    rows: tuple[GradientRow, ...]
    dot_product: float
    sampled: str = ""

    @property
    def passed(self) -> bool:
        """Whether every row and the dot product pass."""
        return all(row.passed for row in self.rows) and self.dot_product <= DOT_PRODUCT_BOUND

    def to_dict(self) -> dict[str, Any]:
        """Values for JSON: under each name, the gradient's relative errors and whether they are within their bounds."""
        gradients = {
            r.name: {
                "size": r.size,
                "gradient": r.gradient,
                "complex_step": r.complex_step,
                "differences": r.differences,
                "rounding": r.rounding,
                "noise": r.noise if math.isfinite(r.noise) else None,
                "passed": r.passed,
                "unfelt": r.unfelt,
                "left_out": r.left_out,
            }
            for r in self.rows
        }
        return {
            "scene": self.scene,
            "steps": self.steps,
            "gradients": gradients,
            "dot_product": self.dot_product,
            "sampled": self.sampled,
            "passed": self.passed,
        }

    def __str__(self) -> str:
        lines = [
            f"Gradient check of '{self.scene}' over {self.steps} substeps: {'passed' if self.passed else 'FAILED'}"
        ]
        if self.sampled:
            lines.append(f"  {self.sampled}")
        width = max(len(r.name) for r in self.rows)
        lines.append(f"  {'':{width}}  {'entries':>7}  {'largest':>9}  {'complex step':>12}  {'differences':>11}")
        for r in self.rows:
            mark = "  nothing felt beyond rounding" if r.unfelt else _noisy(r) if r.passed else "  <- fails"
            mark += f"  without {r.left_out} of redundant constraints" if r.left_out else ""
            lines.append(
                f"  {r.name:{width}}  {r.size:7d}  {r.gradient:9.2e}"
                f"  {r.complex_step:12.1e}  {r.differences:11.1e}{mark}"
            )
        lines.append(f"  dot product <Jv, w> = <v, J'w>: {self.dot_product:.1e}")
        lines.append(
            f"  bounds: complex step {COMPLEX_STEP_BOUND:g}, differences {DIFFERENCES_BOUND:g},"
            f" dot product {DOT_PRODUCT_BOUND:g}"
        )
        return "\n".join(lines)


def _noisy(row: GradientRow) -> str:
    """Which path cannot be judged down to its bound, and down to what it can."""
    words = [f"complex step good to {row.rounding:.0e}"] if row.rounding > COMPLEX_STEP_BOUND else []
    if row.noise > DIFFERENCES_BOUND:
        words.append(f"differences good to {row.noise:.0e}" if math.isfinite(row.noise) else "no differences")
    return "".join(f"  {part}" for part in words)
