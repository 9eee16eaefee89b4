"""Fits the three EI and the damping of the harness, prints the table of the README and draws harness.png.

python experiments/branched_cable/study.py
"""

import sys
from pathlib import Path

import numpy as np
import sheetbend as sb

sys.path.insert(0, str(Path(__file__).parent))
import harness

START = {"trunk_EI": 2e-3, "left_EI": 4e-3, "right_EI": 2e-3, "trunk_bend_damping": 0.05}
SHOWN = (0.0, 1.0, 1.4, 2.5)  # s; the last one is unseen


def fitted(recording, seconds=2.0):
    """The fit to the first `seconds`; refits with twice the links and with half the substep widen the intervals."""
    coarse, fine = (harness.experiment(recording, START, finer, seconds) for finer in (1, 2))
    refine = sb.Refinement(finer=lambda: [fine])
    return sb.fit(coarse, parameters=harness.parameters(START), profiles=False, refine=refine)


def table(fit, true):
    """Lines of name, truth, estimate, interval, and how far the estimate is off in percent."""
    lines = []
    for name, truth in true.items():
        e = fit[name]
        off = 100 * (e.value / truth - 1)
        lines.append(
            f"{name:20} true {truth:.4g}  found {e.value:.5g} [{e.lower:.5g}, {e.upper:.5g}]  {off:+.1f} %  "
            f"statistics alone +-{e.statistical:.2g}, discretization +-{e.discretization:.2g}"
        )
    return lines


def draw(fit, recording, file):
    """Left: the harness from the side at four times, markers beside the fitted simulation. Right: found over true."""
    import matplotlib.pyplot as plt

    scene = harness.scene({name: fit.values[name] for name in START})
    motion = sb.simulate(scene, recording.times, sb.Solver(h=1 / 200), start=sb.equilibrium(scene).nodes)
    colors = {"trunk": "#333333", "left": "#1f77b4", "right": "#d95f02"}
    figure, (sides, found) = plt.subplots(1, 2, figsize=(12, 3.3), width_ratios=(2.9, 1), layout="constrained")
    for k, time in enumerate(SHOWN):
        frame = int(np.argmin(np.abs(recording.times - time)))
        for part, color in colors.items():
            x = motion.positions[frame, scene.ropes[part].particles]
            sides.plot(x[:, 0] + 0.75 * k, x[:, 2], color=color, label=part if k == 0 else None)
            mine = [i for i, name in enumerate(recording.markers) if name.startswith(part)]
            seen = recording.positions[frame, mine]
            sides.plot(seen[:, 0] + 0.75 * k, seen[:, 2], "o", ms=4, mfc="none", color=color)
        label = f"{time:.1f} s" + (", unseen" if time > 2.0 else "")
        sides.annotate(label, (0.75 * k + 0.2, 0.15), ha="center")
    sides.set(xlabel="x, shifted by 0.75 m from time to time (m)", ylabel="z (m)", aspect="equal", ylim=(-0.55, 0.25))
    sides.set_title("Fitted harness (lines) and markers (circles), seen from the side", fontsize=10)
    sides.legend(loc="lower right", frameon=False, fontsize=9)
    sides.set_xlim(-0.15, 3.35)
    true = recording.metadata["true"]
    labels = {"trunk_EI": "EI trunk", "left_EI": "EI left", "right_EI": "EI right", "trunk_bend_damping": "damping"}
    for k, (name, truth) in enumerate(true.items()):
        e = fit[name]
        found.plot([e.lower / truth, e.upper / truth], [-k, -k], color="#333333")
        found.plot(e.value / truth, -k, "o", color="#333333")
    found.axvline(1.0, color="#999999", lw=1, ls="--")
    found.set_yticks([-k for k in range(len(true))], [labels[name] for name in true])
    found.set(xlabel="found over true, 95 % interval", ylim=(-len(true) + 0.5, 0.5))
    figure.savefig(file, dpi=110)


def main():
    recording = sb.Recording.load(harness.FILE)
    fit = fitted(recording)
    print(*table(fit, recording.metadata["true"]), sep="\n")
    (errors,) = fit.result.recordings
    print(f"fitted {1e3 * errors.rms:.2f} mm rms, held out {1e3 * errors.held_out:.2f} mm", end=", ")
    print(f"without physics {1e3 * errors.baseline:.1f} mm; {fit.result.seconds:.0f} s")
    draw(fit, recording, Path(__file__).parent / "harness.png")


if __name__ == "__main__":
    main()
