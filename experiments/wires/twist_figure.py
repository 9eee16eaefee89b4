"""Draws twist.png from out/wires/twist.json, which twist.py writes: python experiments/wires/twist_figure.py"""

import json
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

HERE = Path(__file__).parent
COLORS = {"white": "#999999", "black": "#111111", "red": "#c0392b"}
SHOWN = {"hanging": "#bbbbbb", "half way": "#7fa8d0", "before the snap": "#1f4e8c", "after it": "#d95f02"}


def main():
    tables = json.loads(Path("out/wires/twist.json").read_text(encoding="utf-8"))
    figure, (torques, side, front) = plt.subplots(1, 3, figsize=(12, 4), width_ratios=(1.9, 1, 1), layout="constrained")
    for wire, color in COLORS.items():
        path = tables[wire]["turning"]
        torque = 1e3 * np.array(path["torque_Nm"])
        torques.plot(path["roll_deg"], torque / np.abs(torque).max(), color=color, label=wire)
        given = json.loads((HERE / "data" / f"{wire}_0.json").read_text(encoding="utf-8"))["published"]
        measured = given["critical_twist_deg"]
        torques.axvspan(min(measured), max(measured), color=color, alpha=0.25, lw=0)
    torques.set(xlabel="turn of the end (degrees)", ylabel="torque over its largest")
    torques.set_title("Until the snap; bands: measured snaps", fontsize=10)
    torques.legend(loc="lower right", frameon=False)
    for (label, color), shape in zip(SHOWN.items(), tables["black"]["turning"]["shapes"], strict=True):
        x = np.array(shape)
        style = {"color": color, "ls": (0, (4, 3)) if label == "after it" else "-"}
        side.plot(x[:, 0], x[:, 2], label=label, **style)
        front.plot(x[:, 1], x[:, 2], **style)
    side.set(aspect="equal", xlabel="x (m)", ylabel="z (m)")
    side.set_title("Black, as photographed", fontsize=10)
    front.set(aspect="equal", xlabel="y (m)")
    front.set_title("Black, from the side", fontsize=10)
    figure.legend(*side.get_legend_handles_labels(), loc="outside lower right", ncols=4, frameon=False, fontsize=9)
    figure.savefig(HERE / "twist.png", dpi=110)


if __name__ == "__main__":
    main()
