"""What the three ratios miss of the stretched sheet: settling, slip at the clamps, or stiffness that differs.

Each candidate is added to the same model, fitted to the same stills, and judged on stills 17 to 24. Run from the
repository's root: python experiments/knit_dic/uneven.py. It prints the table and writes it to out/knit_dic/uneven.json;
a minute of processor time.
"""

import json
from dataclasses import dataclass, replace

import numpy as np
import sheetbend as sb
from dic import CELLS, COLUMNS, HEIGHT, REST, ROWS, STILLS, experiment
from sheetbend.quantities.quantities import Term
from study import FIXED, OUT, RATIOS, carried_on, errors, predicted, stretch

FITTED = (8, 10, 12, 14, 16)
SETTLED = 7  # the first still in which every row is stretched by about as much as the others
SPREAD = 0.3  # of the logarithm of the stiffness, divided by the mode's number: smooth fields are likelier


@dataclass(frozen=True)
class Model:
    """A sheet to be fitted.

    Attributes:
        rest: still whose shape is the one without stress.
        along, across: cosines of the field of stiffness over the height and over the width.
        slip: whether the material at the clamps lags behind the rows there, in parts of the sheet's mean strain.
        law: how tension grows with strain.
    """

    rest: int = 1
    along: int = 0
    across: int = 0
    slip: bool = False
    law: object = sb.laws.Linear()

    def modes(self):
        return [(i, j) for i in range(self.along + 1) for j in range(self.across + 1) if i + j]

    def parameters(self):
        field = {f"field_{i}_{j}": {"prior": (0.0, SPREAD / np.hypot(i, j))} for i, j in self.modes()}
        slips = {f"slip_{end}": {"prior": (0.0, 0.1)} for end in ("top", "bottom")} if self.slip else {}
        stiffening = {f"knit_{c}_stiffening": {"lower": 0.01, "upper": 100.0} for c in ("warp", "weft")}
        return RATIOS | FIXED | field | slips | (stiffening if isinstance(self.law, sb.laws.Exponential) else {})

    def change(self, still):
        """What is added to the scene of a still."""

        def change(scene, cloth, flat):
            if self.modes():
                _vary(scene, cloth, flat, self.modes())
            if self.slip:
                _let_slip(scene, cloth, flat, stretch(still) - stretch(self.rest))

        return change

    def fitted(self, stills=FITTED, cells=CELLS):
        experiments = [experiment(k, self.law, cells, self.rest, self.change(k)) for k in stills]
        return sb.fit(experiments, parameters=self.parameters(), profiles=False)

    def predicted(self, still, values, cells=CELLS):
        return predicted(still, values, self.law, cells, self.rest, self.change(still))


def _vary(scene, cloth, flat, modes):
    """Multiplies the membrane's stiffness by exp(sum of modes), cosines over the sheet at rest."""
    known = {tuple(cloth.particles[t].tolist()): k for k, t in enumerate(flat.triangles)}
    group, _, _ = scene.group("knit_membrane")
    own = [known[tuple(p)] for p in group.particles.tolist()]
    x, y, _ = flat.vertices[flat.triangles[own]].mean(axis=1).T
    for i, j in modes:
        scene.add_quantity(f"field_{i}_{j}", 0.0, "", positive=False, scale=0.1)
    softer = tuple((f"field_{i}_{j}", -np.cos(i * np.pi * y / HEIGHT) * np.cos(j * np.pi * x)) for i, j in modes)
    for k, term in enumerate(scene.terms):
        if term.array == "compliance" and ("knit_warp", "inverse") in term.factors:
            scene.terms[k] = replace(term, exponents=softer)


def _let_slip(scene, cloth, flat, strain):
    """Moves the held rows towards the middle by slip * mean strain * height."""
    for name, sign in (("top", -1.0), ("bottom", 1.0)):
        scene.add_quantity(f"slip_{name}", 0.0, "", positive=False, scale=0.1)
        index = 3 * cloth.particles[flat.sets[name]] + 1
        scene.add_terms([Term("position", index, sign * strain * HEIGHT, ((f"slip_{name}", "identity"),))])


def settling(still):
    """Strain of the rows beside the clamps (two of them at each end) and of the ten in the middle, along the pull."""
    y, rest = (p.reshape(ROWS, COLUMNS, 3)[..., 1] for p in (STILLS[still - 1], REST))
    strain = np.diff(y, axis=0).mean(axis=1) / np.diff(rest, axis=0).mean(axis=1) - 1.0
    middle = slice((ROWS - 11) // 2, (ROWS - 11) // 2 + 10)
    return [float(strain[part].mean()) for part in (slice(0, 2), middle, slice(-2, None))]


MODELS = {
    "three ratios": Model(),
    "slip of each clamp": Model(slip=True),
    "stiffness along the strip": Model(along=4),
    "stiffness over the sheet": Model(along=3, across=6),
    "settled": Model(rest=SETTLED),
    "settled, slip of each clamp": Model(rest=SETTLED, slip=True),
    "settled, stiffness along the strip": Model(rest=SETTLED, along=4),
    "settled, stiffening": Model(rest=SETTLED, law=sb.laws.Exponential(1.0, 1.0, 1.0)),
    "settled, stiffness over the sheet": Model(rest=SETTLED, along=3, across=6),
    "settled, both": Model(rest=SETTLED, along=3, across=6, slip=True),
}
LINES = {"line per point, stills 2 to 16": range(2, 17), "line per point, the same stills": FITTED}


def judged(model):
    """A model's errors and numbers."""
    fit = model.fitted()
    row = errors(lambda k: model.predicted(k, fit.values))
    numbers = {e.name: [e.value, e.half_width] for e in fit.result.estimates if not e.name.startswith("field")}
    return row | {"free": len(fit.result.estimates) - 1, "cost": fit.result.cost, "numbers": numbers}


def main():
    for still in (3, 5, SETTLED, 16, 24):
        told = ", ".join(f"{100 * s:.1f}" for s in settling(still))
        print(f"still {still}: strain of the sheet {100 * stretch(still):.1f} %; top, middle, bottom {told} %")
    table = {}
    for name, model in MODELS.items():
        table[name] = row = judged(model)
        told = ", ".join(
            f"{n.removeprefix('knit_')} {value:.3g}" + ("" if half is None else f" +- {half:.2g}")
            for n, (value, half) in row["numbers"].items()
        )
        print(f"{name}: {row['px']:.1f} px, {row['percent']:.2f} %, {row['free']} free; {told}", flush=True)
    for name, stills in LINES.items():
        table[name] = row = errors(lambda k, stills=stills: carried_on(k, tuple(stills)))
        print(f"{name}: {row['px']:.1f} px, {row['percent']:.2f} %")
    OUT.mkdir(parents=True, exist_ok=True)
    (OUT / "uneven.json").write_text(json.dumps(table, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
