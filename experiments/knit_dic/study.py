"""Fits a stretched sheet's ratios of stiffness to stills 2 to 16 and predicts stills 17 to 24.

Run from the repository's root: python experiments/knit_dic/study.py. It prints its tables and writes them, and the
fields of the picture, to out/knit_dic.
"""

import json
from pathlib import Path

import numpy as np
import sheetbend as sb
from dic import CELLS, COLUMNS, INSIDE, ORIGIN, PX, REST, ROWS, STILLS, blended, experiment, harmonic, scaled

FITTED, PREDICTED = tuple(range(2, 17)), tuple(range(17, 25))  # still 1 is the shape at rest
COARSE = (4, 8, 12, 16)
OUT = Path("out/knit_dic")
RATIOS = {
    "knit_weft": {},
    "knit_shear": {"initial": 0.1, "lower": 1e-3, "upper": 10.0},
    "knit_poisson": {"lower": -0.95, "upper": 0.95},
}
FIXED = {"knit_warp": {"fixed": True}}
# Ratios of one knit from another recording: experiments/knit_uniaxial, garter, exponential law.
PULLED = {"knit_weft": 0.45, "knit_shear": 0.16, "knit_poisson": 0.33}


def fitted(stills=FITTED, parameters=None, law=None, cells=CELLS, refine=False):
    law = law or sb.laws.Linear()

    def built(count):
        return [experiment(k, law, count) for k in stills]

    finer = sb.Refinement(finer=lambda: built(tuple(2 * n for n in cells))) if refine else None
    return sb.fit(built(cells), parameters=parameters or RATIOS | FIXED, refine=finer, profiles=False)


def predicted(still, values, law=None, cells=CELLS, rest=1, change=None):
    """Points inside at given values, (points, 3) px."""
    e = experiment(still, law or sb.laws.Linear(), cells, rest, change)
    known = {name: value for name, value in values.items() if name in e.scene.quantities}
    x = sb.equilibrium(e.scene, values=known).positions
    points = [np.array(place.weights) @ x[list(place.particles)] for place in e.places]
    return ORIGIN + PX * (np.array(points) + scaled(measured(still)) - e.recording.positions[0])


def carried_on(still, stills=FITTED):
    """The blend, and each point's deviation from it along a line against stretch through some stills."""
    off = np.array([(measured(k) - inside(blended(k))).ravel() for k in stills])
    slope, start = np.polyfit([stretch(k) for k in stills], off, 1)
    return inside(blended(still)) + (start + slope * stretch(still)).reshape(-1, 3)


def stretch(still):
    """Mean strain between the prescribed rows."""
    y = STILLS[still - 1].reshape(ROWS, COLUMNS, 3)[..., 1].mean(axis=1)
    rest = REST.reshape(ROWS, COLUMNS, 3)[..., 1].mean(axis=1)
    return float((y[0] - y[-1]) / (rest[0] - rest[-1]) - 1)


def inside(points):
    return points.reshape(-1, 3)[INSIDE]


def measured(still):
    return STILLS[still - 1][INSIDE]


def gap(points, still):
    """Mean distance to the measured points, px."""
    return float(np.linalg.norm(points - measured(still), axis=1).mean())


def errors(predict):
    """Mean errors of stills 17 to 24, px and in % of the mean displacement from rest, and px of still 24."""
    each = [gap(predict(k), k) for k in PREDICTED]
    moved = float(np.mean([gap(REST[INSIDE], k) for k in PREDICTED]))
    return {"px": float(np.mean(each)), "percent": 100 * float(np.mean(each)) / moved, "of still 24": each[-1]}


def compared(values):
    predictions = {
        "fitted ratios": lambda k: predicted(k, values),
        "finer mesh": lambda k: predicted(k, values, cells=tuple(2 * n for n in CELLS)),
        "isotropic, Poisson 0.3": lambda k: predicted(k, {"knit_shear": 1 / 2.6, "knit_poisson": 0.3}),
        "ratios of the pulled garter": lambda k: predicted(k, PULLED),
        "harmonic": lambda k: inside(harmonic(k)),
        "blend of both rows": lambda k: inside(blended(k)),
        "blend, each point's deviation carried on": carried_on,
    }
    return {name: errors(predict) for name, predict in predictions.items()}


def summary(fit):
    return {
        e.name: {
            "value": e.value,
            "interval": [e.lower, e.upper],
            "mesh": e.discretization,
            "verdict": e.verdict,
            "words": e.words,
        }
        for e in fit.result.estimates
    }


def main():
    OUT.mkdir(parents=True, exist_ok=True)
    tables = {}
    free = fitted(COARSE[-2:], RATIOS | {"knit_warp": {}})
    tables["warp free"] = {"gauges": free.result.gauges, "estimates": summary(free)}
    print(*free.result.gauges, sep="\n")

    fit = fitted(refine=True)
    print(fit.report())
    (OUT / "report.txt").write_text(fit.report() + "\n", encoding="utf-8")
    tables["linear"] = {"cost": fit.result.cost, "seconds": fit.result.seconds, "estimates": summary(fit)}
    tables["fitted stills, px"] = {k: gap(predicted(k, fit.values), k) for k in FITTED}
    tables["predicted"] = compared(fit.values)
    for name, row in tables["predicted"].items():
        print(f"{name}: " + ", ".join(f"{key} {value:.1f}" for key, value in row.items()))

    bounds = {f"knit_{c}_stiffening": {"lower": 0.01, "upper": 100.0} for c in ("warp", "weft")}
    stiffening = fitted(COARSE, RATIOS | FIXED | bounds, sb.laws.Exponential(1.0, 1.0, 1.0))
    tables["exponential"] = {"cost": stiffening.result.cost, "estimates": summary(stiffening)}
    tables["linear, same stills"] = {"cost": fitted(COARSE).result.cost}
    print(stiffening.report())
    (OUT / "study.json").write_text(json.dumps(tables, indent=1) + "\n", encoding="utf-8")
    np.savez_compressed(OUT / "still_24.npz", fitted=predicted(24, fit.values), harmonic=inside(harmonic(24)))


if __name__ == "__main__":
    main()
