"""A recording that was simulated at the fit's own substep is not moved to the limit of short ones."""

from __future__ import annotations

import numpy as np
import sheetbend as sb

NAMES = ["rope_EI", "rope_bend_damping", "rope_drag_linear"]


def swinging(**changed: float) -> sb.Scene:
    values = {"EI": 1e-3, "bend_damping": 3e-3, "drag_linear": 5e-3, **changed}
    return sb.rope(0.6, 20, density=0.05, clamp_start=(1, 0, 0), **values)


def test_the_estimate_stays_and_a_warning_names_the_cause() -> None:
    times, solver = np.arange(150) / 100, sb.Solver(h=1 / 400)
    true = swinging()
    seen = true.ropes["rope"].particles[3::3]
    x = sb.simulate(true, times, solver).positions[:, seen]
    x += 1e-3 * np.random.default_rng(0).standard_normal(x.shape)

    def fitted(refine: str | bool) -> sb.Fit:
        places = [sb.on_particle(int(p)) for p in seen]
        experiment = sb.Experiment(
            scene=swinging(EI=2e-3, bend_damping=1e-3), recording=sb.Recording(x, times), markers=places, solver=solver
        )
        return sb.fit(experiment, parameters=NAMES, refine=refine, profiles=False)

    found = fitted("auto")
    for name, truth in (("rope_EI", 1e-3), ("rope_bend_damping", 3e-3), ("rope_drag_linear", 5e-3)):
        kept = found[name]
        assert kept.verdict == "identified" and kept.moved == 0.0 and kept.lower is not None and kept.upper is not None
        assert kept.lower < truth < kept.upper
    (warning,) = (w for w in found.result.warnings if "short substeps" in w)
    assert "simulated at the same substep" in warning and "refine=False" in warning
    narrow, wide = fitted(False)["rope_EI"], found["rope_EI"]
    assert narrow.value == wide.value and narrow.half_width is not None and wide.half_width is not None
    assert wide.half_width > 3 * narrow.half_width  # all that the limit would move
