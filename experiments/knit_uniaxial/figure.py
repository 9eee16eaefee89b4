"""Draws forces.png from out/knit_uniaxial/study.json, which study.py writes.

python experiments/knit_uniaxial/figure.py
"""

import json
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from knits import DIRECTIONS, FITTED, KNITS, PRETENSION, read

COLORS = {"linear": "#7fa8d0", "spline": "#3a8f5c", "exponential": "#f2b48a", "weighted": "#d95f02", "sinh": "#7b3294"}
WORDS = {"weighted": "exponential law, weighted", "sinh": "sinh law, weighted"}


def main():
    tables = json.loads(Path("out/knit_uniaxial/study.json").read_text(encoding="utf-8"))
    figure, panels = plt.subplots(2, 4, figsize=(13, 6), layout="constrained")
    for column, knit in zip(panels.T, KNITS, strict=True):
        for panel, along in zip(column, DIRECTIONS, strict=True):
            pull, predictions = read(knit, along), tables[knit][along]["predictions"]
            for i, repeat in enumerate(pull.repeats):
                color, label = ("#888888", "repeats 1 to 3") if i in FITTED else ("#111111", "repeats 4, 5: unseen")
                first = i in (0, 3)
                panel.plot(
                    repeat.strain, PRETENSION + repeat.force, color=color, lw=0.9, label=label if first else None
                )
            for law, color in COLORS.items():
                strain, force = (np.array(predictions[law]["curve"][k]) for k in ("strain", "force"))
                seen = strain <= pull.fitted
                panel.plot(
                    strain[seen], PRETENSION + force[seen], color=color, lw=2, label=WORDS.get(law, f"{law} law")
                )
                panel.plot(strain[~seen], PRETENSION + force[~seen], color=color, lw=2, ls=(0, (2, 1)))
            panel.axvspan(pull.fitted, 1.05 * pull.end, color="#f2f2f2", lw=0, zorder=0)
            panel.set(xlim=(0, 1.05 * pull.end), ylim=(0, 32), title=f"{knit}, along {along}")
    for panel in panels[1]:
        panel.set_xlabel("strain between the pins")
    for panel in panels[:, 0]:
        panel.set_ylabel("force (N)")
    panels[0, 0].legend(frameon=False, fontsize=8, loc="upper left")
    figure.suptitle("Fitted up to 60 % of the range; gray ground and dashes: predicted", fontsize=11)
    figure.savefig(Path(__file__).parent / "forces.png", dpi=110)


if __name__ == "__main__":
    main()
