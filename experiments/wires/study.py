"""What wires.toml does not show by itself: which part of the model explains how much, rehangings one by one,
predictions, branches.

Run from the repository's root: python experiments/wires/study.py. It prints its tables and writes them to
out/wires/study.json.
"""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import sheetbend as sb
from sheetbend.config import build, parse

FILE = Path(__file__).parent / "wires.toml"
CONFIG = parse(FILE)
PUBLISHED = {"white": 5, "black": 14, "red": 17}  # standard deviation of EI over five rehangings, % of its mean

NEAR, NEAR_SIGMA = 3, 0.003  # points beside each clamp from which a holder's angle is found: 9 cm; m


def study(wire, shapes=(0, 1, 2), angles=True, modes=(1,), predicted=None):
    """One wire of wires.toml with parts of the model left out; `predicted` is a shape that the fit does not see."""
    rope = next(r for r in CONFIG.scene.rope if r.name == wire).model_copy(
        update={"clamp_angles": angles, "set_modes": list(modes)}
    )
    shown = [r for r in CONFIG.recording if r.ropes == [wire]]
    recordings = [shown[k].model_copy(update={"predict": "mean" if k == predicted else None}) for k in shapes]
    given = CONFIG.parameters
    parameters = {f"{wire}_EI": given[f"{wire}_EI"]}
    parameters |= {f"{wire}_set_{k}": given[f"{wire}_set_1"] for k in modes}
    parameters |= {f"{wire}_{end}_angle": given[f"{wire}_{end}_angle"] for end in ("start", "end") if angles}
    scene = CONFIG.scene.model_copy(update={"rope": [rope]})
    return build(
        CONFIG.model_copy(update={"scene": scene, "recording": recordings, "parameters": parameters, "published": {}}),
        FILE.parent,
    )


def fitted(part, **options):
    return sb.fit(part.experiments, parameters=part.parameters, **options)


def gap(comparison, shape=None):
    """Mean distance [mm] between measured and simulated (or other) points; the two held ends do not count."""
    other = comparison.simulated if shape is None else shape
    return 1e3 * float(np.linalg.norm(other - comparison.recording.positions, axis=-1).mean())


def explained(wire):
    """EI and mean gap as parts of the model come in."""
    variants = {
        "EI alone": (False, ()),
        "EI, set": (False, (1,)),
        "EI, angles": (True, ()),
        "EI, angles, set": (True, (1,)),
    }
    rows = {}
    for name, (angles, modes) in variants.items():
        fit = fitted(study(wire, angles=angles, modes=modes))
        e = fit[f"{wire}_EI"]
        rows[name] = {
            "EI": e.value,
            "lower": e.lower,
            "upper": e.upper,
            "gap_mm": float(np.mean([gap(c) for c in fit.comparisons])),
            "cost": fit.result.cost,
        }
    return rows


def one_by_one(wire):
    """EI alone, each shape by itself."""
    alone = [fitted(study(wire, shapes=(k,), angles=False, modes=()))[f"{wire}_EI"].value for k in range(3)]
    return {
        "EI": alone,
        "sd_percent": 100 * float(np.std(alone, ddof=1) / np.mean(alone)),
        "published_percent": PUBLISHED[wire],
    }


def leave_one_out(wire):
    """The third shape from EI, set and mean angles of the other two, beside the mean of the other two shapes."""
    rows = []
    for k in range(3):
        fit = fitted(study(wire, predicted=k))
        c = next(c for c in fit.comparisons if c.experiment.predict)
        rows.append(
            {
                "shape": c.experiment.name,
                "EI": fit[f"{wire}_EI"].value,
                "gap_mm": gap(c),
                "baseline_mm": gap(c, c.baseline),
            }
        )
    return rows


def hung(wire, shape, known, near=None):
    """One shape at a known EI and set, (51, 3) m, with holder angles found from its first `near` points beside each
    clamp (all of them if None)."""
    (experiment,) = study(wire, shapes=(shape,)).experiments
    places, last = list(experiment.places), len(experiment.places) - 1
    seen = [near is None or 0 < k <= near or last - near <= k < last for k in range(len(places))]
    shown = replace(
        experiment,
        markers=[place if part else None for place, part in zip(places, seen, strict=True)],
        sigma=experiment.sigma if near is None else NEAR_SIGMA,
    )
    angle = {key: value for key, value in given_angle(wire).items() if key != "private"}
    angles = {f"{wire}_{end}_angle": angle for end in ("start", "end")}
    fixed = {name: {"initial": value, "fixed": True} for name, value in known.items()}
    fit = sb.fit([shown], parameters=fixed | angles, profiles=False)
    scene = experiment.scene
    values = {q: fit.values[q] for q in scene.quantities if q in fit.values}
    x = sb.equilibrium(scene, values=values).positions
    return np.array([np.array(place.weights) @ x[list(place.particles)] for place in places])


def given_angle(wire):
    """Prior and bounds of a holder's angle in wires.toml."""
    return CONFIG.parameters[f"{wire}_start_angle"].model_dump(exclude_unset=True)


def own_angles(wire, near=NEAR):
    """The third shape with its own holder angles, EI and set from the other two: by the model alone, and as the mean of
    the other two shapes moved by what the model makes of the difference in angles. mm, over the points that no angle
    was found from (all of them if `near` is None), beside the mean of the other two."""
    photos = [study(wire, shapes=(k,)).experiments[0].recording.positions[0] for k in range(3)]
    rows, rest = [], slice((near or 0) + 1, 50 - (near or 0))
    for k in range(3):
        fit = fitted(study(wire, predicted=k), profiles=False)
        known = {name: fit.values[name] for name in (f"{wire}_EI", f"{wire}_set_1")}
        model, others = [hung(wire, j, known, near) for j in range(3)], [j for j in range(3) if j != k]
        predictions = {
            "model": model[k],
            "moved": np.mean([photos[j] + model[k] - model[j] for j in others], axis=0),
            "baseline": np.mean([photos[j] for j in others], axis=0),
        }
        rows.append(
            {n: 1e3 * float(np.linalg.norm((p - photos[k])[rest], axis=1).mean()) for n, p in predictions.items()}
        )
    return rows


def own_angles_of_all(wire):
    """The same with angles from the whole shape: what an exact angle would be worth."""
    return own_angles(wire, None)


def refinement():
    """The fit of all nine shapes, as the command line runs it."""
    all_nine = build(CONFIG, FILE.parent)
    fit = fitted(all_nine, **all_nine.options)
    rows = {"seconds": fit.result.seconds}
    for wire in PUBLISHED:
        e = fit[f"{wire}_EI"]
        shapes = [gap(c) for c in fit.comparisons if c.experiment.name.startswith(wire)]
        moved, known = 100 * e.discretization / e.value, 100 * e.half_width / e.value
        rows[wire] = {
            "EI": e.value,
            "gap_mm": float(np.mean(shapes)),
            "moved_percent": moved,
            "half_width_percent": known,
        }
    return rows


def uniform_set(wire):
    """What the tool says when a uniform set is asked for too."""
    e = fitted(study(wire, modes=(0, 1)))[f"{wire}_set_0"]
    return f"{e.name}: {e.verdict}; {e.words}"


def branches(wire):
    """Shapes that the wire can hang in at its fitted values, from several starts, and how far each is from the first
    photograph."""
    part = study(wire)
    fit = fitted(part)
    first, c = part.experiments[0], fit.comparisons[0]
    scene, rope = first.scene, first.scene.ropes[wire]
    values = {
        q: fit.values.get(f"{q}[{first.name}]", fit.values.get(q, scene.quantities[q].value)) for q in scene.quantities
    }
    start = sb.equilibrium(scene).nodes
    ends, s = start[rope.particles][[0, -1]], (rope.arc_length / rope.length)[:, None]
    starts = [start]
    for turns in (-2, 0, 1, 2):  # a circle through both ends, closed so many times; 0: sagging without a loop
        a = 2 * np.pi * turns * s
        r = 1.5 / (2 * np.pi * max(abs(turns), 1))
        loop = (
            np.hstack([np.sign(turns) * np.sin(a), 0 * s, np.cos(a) - 1])
            if turns
            else np.hstack([0 * s, 0 * s, -3 * np.sin(np.pi * s)])
        )
        x = start.copy()
        x[rope.particles] = ends[0] + s * (ends[1] - ends[0]) + r * loop
        starts.append(x)
    measured = c.recording.positions[0]
    rows = []
    for e in sb.equilibria(scene, starts, values, tolerance=1e-4):
        x = e.positions[rope.particles]
        near = np.stack([np.interp(np.linspace(0, 1, 51)[1:-1], s[:, 0], x[:, k]) for k in range(3)], axis=1)
        rows.append(
            {
                "energy_J": e.energy,
                "gap_mm": 1e3 * float(np.linalg.norm(near - measured, axis=-1).mean()),
                "turning_over_2_pi": turning(x),
            }
        )
    again = fitted(
        part, starts=[{f"{wire}_EI": factor * fit[f"{wire}_EI"].value} for factor in (0.25, 4.0)]
    ).result.starts
    return {
        "shapes": rows,
        "EI_of_starts": [start.values[f"{wire}_EI"] for start in again],
        "cost_of_starts": [start.cost for start in again],
    }


def turning(x):
    d = np.diff(x[:, [0, 2]], axis=0)
    a = np.unwrap(np.arctan2(d[:, 1], d[:, 0]))
    return float((a[-1] - a[0]) / (2 * np.pi))


def show(table, indent="  "):
    """One line per row; a row holds numbers and words only."""
    for key, row in table.items() if isinstance(table, dict) else enumerate(table):
        parts = list(row.values()) if isinstance(row, dict) else row if isinstance(row, list) else []
        if any(isinstance(part, dict | list) for part in parts):
            print(f"{indent}{key}")
            show(row, indent + "  ")
        elif isinstance(row, dict):
            print(f"{indent}{key}: " + ", ".join(f"{name} {text(value)}" for name, value in row.items()))
        else:
            print(f"{indent}{key}: {text(row)}")


def text(value):
    if isinstance(value, list):
        return " ".join(text(part) for part in value)
    return f"{value:.3g}" if isinstance(value, float) else str(value)


STUDIES = (explained, one_by_one, leave_one_out, own_angles, own_angles_of_all, uniform_set, branches)


def main():
    tables = {"all nine": refinement()}
    show(tables)
    for wire in PUBLISHED:
        tables[wire] = {f.__name__: f(wire) for f in STUDIES}
        show({wire: tables[wire]})
    Path("out/wires").mkdir(parents=True, exist_ok=True)
    Path("out/wires/study.json").write_text(json.dumps(tables, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
