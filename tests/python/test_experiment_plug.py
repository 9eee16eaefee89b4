"""A cable with a plug, coarser than the experiment has it: what is fitted, and what a fit without the plug says."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import sheetbend as sb

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "experiments" / "plug"))
COARSE = 12


def recording() -> sb.Recording:
    from plug import recorded, swing

    return recorded(swing(COARSE), np.random.default_rng(1))


def test_stiffness_and_plug_from_a_cable_twice_as_fine() -> None:
    from plug import TRUTH, fitted

    found = fitted(recording(), segments=COARSE)
    for name, value in TRUTH.items():
        one = found[name]
        assert one.verdict in ("identified", "weak"), name  # weak: the center of mass along the cable
        assert one.lower is not None and one.upper is not None and one.lower <= value <= one.upper, name
    for name, part in (("cable_EI", 0.03), ("cable_GJ", 0.03), ("plug_mass", 0.02)):
        assert abs(found[name].value / TRUTH[name] - 1) < part, name
    for name in ("plug_center_x", "plug_center_y", "plug_center_z"):
        assert abs(found[name].value - TRUTH[name]) < 1e-3, name


def test_without_the_plug_the_stiffness_is_wrong_and_doubtful() -> None:
    from plug import TRUTH, experiment

    e = experiment(recording(), COARSE, plugged=False)
    found = sb.fit(e, parameters=["cable_EI", "cable_bend_damping"], refine=False, profiles=False, beginnings=False)
    assert abs(found["cable_EI"].value / TRUTH["cable_EI"] - 1) > 0.2
    assert found["cable_EI"].verdict not in ("identified", "weak", "one-sided")
    assert any("misses" in warning for warning in found.result.warnings)
