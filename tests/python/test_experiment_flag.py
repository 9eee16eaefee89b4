"""The flag on a hinged pole: its configuration, what its motion shows, and its fit."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import sheetbend as sb
from sheetbend.config import build, parse
from sheetbend.config.build import Study

FLAG = Path(__file__).resolve().parents[2] / "experiments" / "flag" / "flag.toml"


def study() -> Study:
    return build(parse(FLAG), FLAG.parent)


def test_the_edge_swings_with_the_pole_as_recorded() -> None:
    """At the true values, on the mesh of the fit; its error is that of the coarse mesh and of the noise."""
    (e,) = study().experiments
    true = parse(FLAG).published
    motion = sb.simulate(e.scene, e.recording.times, e.solver, true)
    pole, cloth = e.scene.bodies["pole"], e.scene.cloths["flag"]
    edge = cloth.particles[cloth.mesh.sets["top"]]
    origin, frame = pole.pose(e.scene.nodes)
    kept = (e.scene.positions[edge] - origin) @ frame
    origin, frame = pole.pose(motion)
    assert motion.positions[:, edge] == pytest.approx(origin[:, None] + kept @ np.swapaxes(frame, 1, 2), abs=1e-7)
    assert np.ptp(frame[:, 1, 1]) > 0.02  # it swings by 12 degrees and more
    found = np.stack([place.body.pose(motion)[0] + frame @ place.offset for place in e.places[-2:]], axis=1)
    off = found - e.recording.positions[:, -2:]
    assert np.sqrt((off**2).mean()) < 6e-4


@pytest.mark.slow
def test_its_fit_finds_the_truth() -> None:
    one = study()
    found = sb.fit(one.experiments, parameters=one.parameters, **one.options)
    for name, value in parse(FLAG).published.items():
        assert found[name].lower < value < found[name].upper, str(found[name])
        assert found[name].verdict == "identified", str(found[name])
    (row,) = found.result.recordings
    assert row.held_out < 1e-3
