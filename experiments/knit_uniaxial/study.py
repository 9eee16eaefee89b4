"""Fits the four knits up to 60 % of their range of strain, and predicts unseen repeats and the rest of the range.

Run from the repository's root: python experiments/knit_uniaxial/study.py. It prints its tables and writes them to
out/knit_uniaxial/study.json.
"""

import json
import time
from pathlib import Path

import numpy as np
import sheetbend as sb
from knits import CELLS, DIRECTIONS, EVEN, FITTED, KNITS, PRETENSION, SHARE, UNSEEN, Sheet, Weights, experiments, read
from scipy.interpolate import PchipInterpolator
from scipy.optimize import curve_fit

SEEN, REST = (
    np.linspace(0.1, 1.0, 10),
    np.linspace(0.125, 1.0, 8),
)  # of the fitted strain, of the way from there to the end
STIFFNESS = {
    "knit_warp": {},
    "knit_weft": {},
    "knit_shear": {"initial": 2.0, "prior": (2.0, 1.0)},  # N per clamp width, within a factor of e
    "knit_poisson": {"lower": -0.95, "upper": 0.95},
}
STIFFENING = {f"knit_{c}_stiffening": {"lower": 0.01, "upper": 100.0} for c in ("warp", "weft")}
RATIOS = {f"knit_{c}_ratio_{k}": {"lower": 0.02, "upper": 50.0} for c in ("warp", "weft") for k in (1, 2, 3, 4)}
PARAMETERS = {
    "linear": STIFFNESS,
    "exponential": STIFFNESS | STIFFENING,
    "spline": STIFFNESS | RATIOS,
    "weighted": STIFFNESS | STIFFENING,
    "sinh": STIFFNESS | STIFFENING,
}
WEIGHTED = Weights(
    2.0, 4.0
)  # of `weighted`, the exponential law, and `sinh`; chosen within the range by choose_weights.py
CARRIED_ON = ("weighted", "sinh")


def law_of(name, pulls):
    if name == "linear":
        return sb.laws.Linear()
    if name in ("exponential", "weighted"):
        return sb.laws.Exponential(warp=1.0, weft=1.0, shear=1.0)
    if name == "sinh":
        return sb.laws.Sinh(warp=1.0, weft=1.0, shear=1.0)
    # Four pieces up to the largest Green strain that is fitted.
    along = [((1 + p.fitted) ** 2 - 1) / 2 for p in pulls]
    return sb.laws.Spline(spacing=(along[0] / 4, along[1] / 4, 0.25))


def fitted(knit, law, cells=CELLS, refine=False, share=SHARE, weights=EVEN):
    """One fit of both directions: x is the warp, y the weft."""
    pulls = [read(knit, along, share) for along in DIRECTIONS]

    def built(count):
        return [e for pull in pulls for e in experiments(pull, law_of(law, pulls), count, weights)]

    finer = sb.Refinement(finer=lambda: built(4 * cells)) if refine else None
    return sb.fit(built(cells), parameters=PARAMETERS[law], refine=finer, profiles=False)


def alone(knit, along):
    """What one direction by itself tells of the linear law."""
    return sb.fit(experiments(read(knit, along), sb.laws.Linear()), parameters=STIFFNESS, profiles=False)


def curve(pull, law, values, cells=CELLS):
    """Force above the pretension and width as functions of strain, of the sheet with those values."""
    known = [pull.repeats[i] for i in FITTED]
    length, width = (float(np.mean([getattr(r, side) for r in known])) for side in ("length", "width"))
    loads, strains, widths, start = np.geomspace(0.3, 45.0, 14), [0.0], [width], None
    for load in loads:
        sheet = Sheet(pull, load, law, cells)
        rest = sb.equilibrium(sheet.scene, start, values)
        start = rest.positions
        at = [place_of(start, place) - sheet.middle for place in sheet.pins([length], [width])]
        strains.append(2 * np.linalg.norm(at[0]) / length - 1)
        widths.append(2 * np.linalg.norm(at[1]))
    forces = np.concatenate([[0.0], loads])
    return PchipInterpolator(strains, forces), PchipInterpolator(strains, np.array(widths) / width)


def place_of(positions, place):
    return np.array(place.weights) @ positions[list(place.particles)]


def without_physics(pull):
    """Force above the pretension by the mean of the fitted repeats: as it is, and carried on from 60 % of the range by
    a line, a quadratic and an exponential curve."""
    s = np.linspace(0.0, pull.fitted, 31)
    mean = np.mean([pull.repeats[i].force_at(s) for i in FITTED], axis=0)
    (slope,), quadratic = curve_fit(lambda s, a: a * s, s, mean)[0], np.polyfit(s, mean, 2)
    exponential, _ = curve_fit(lambda s, a, b: a * np.expm1(b * s / pull.fitted), s, mean, (1.0, 1.0), bounds=(0, 20))
    return {
        "mean curve": lambda at: np.interp(at, s, mean, right=np.nan),
        "line": lambda at: slope * at,
        "quadratic": lambda at: np.polyval(quadratic, at),
        "exponential curve": lambda at: exponential[0] * np.expm1(exponential[1] * at / pull.fitted),
    }


def seen(pull):
    return SEEN * pull.fitted


def errors(pull, force_of, s, repeats=UNSEEN):
    """Relative errors of the gauge's force on some repeats at strains s, (repeats, strains); NaN beyond an end."""
    measured = np.array([pull.repeats[i].force_at(s) for i in repeats])
    return (force_of(s) - measured) / (measured + PRETENSION)


def percent(values):
    return 100 * float(np.sqrt(np.nanmean(np.square(values))))


def scatter(pull):
    """Standard deviation of the five repeats' force over its mean, rms over the fitted range, %."""
    force = PRETENSION + np.array([r.force_at(seen(pull)) for r in pull.repeats])
    return percent(force.std(axis=0, ddof=1) / force.mean(axis=0))


def last(values):
    """Mean error at the end of the range, %."""
    return 100 * float(np.nanmean([row[~np.isnan(row)][-1] for row in values]))


def judged(knit):
    """Fits of the laws, and what they and curves without physics predict of each direction."""
    pulls = {along: read(knit, along) for along in DIRECTIONS}
    table = {
        along: {
            "strain at 60 %": p.fitted,
            "strain at the end": p.end,
            "force at 60 %": float(p.loads()[-1]) + PRETENSION,
            "scatter": scatter(p),
            "predictions": {},
        }
        for along, p in pulls.items()
    }
    for law, parameters in PARAMETERS.items():
        began = time.perf_counter()
        fit = fitted(knit, law, refine=law == "exponential", weights=WEIGHTED if law in CARRIED_ON else EVEN)
        table[law] = {
            "parameters": len(parameters),
            "cost": fit.result.cost,
            "seconds": time.perf_counter() - began,
            "estimates": summary(fit),
        }
        for along, pull in pulls.items():
            force_of, width_of = curve(pull, law_of(law, list(pulls.values())), fit.values)
            row = prediction(pull, force_of)
            s = seen(pull)
            narrowing = np.array([pull.repeats[i].narrowing_at(s) for i in UNSEEN])
            row["width"] = percent(1 - width_of(s) - narrowing)
            shown = np.linspace(0.0, pull.end, 41)
            row["curve"] = {
                "strain": shown.tolist(),
                "force": force_of(shown).tolist(),
                "width": width_of(shown).tolist(),
            }
            table[along]["predictions"][law] = row
    for along, pull in pulls.items():
        for name, force_of in without_physics(pull).items():
            table[along]["predictions"][name] = prediction(pull, force_of)
    return table


def prediction(pull, force_of):
    rest = errors(pull, force_of, pull.fitted + REST * (pull.end - pull.fitted))
    row = {"in the range": percent(errors(pull, force_of, seen(pull)))}
    if not np.isnan(rest[:, 0]).all():
        row |= {"beyond": percent(rest), "at the end": last(rest)}
    return row


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


def show(knit, table):
    for along in DIRECTIONS:
        t = table[along]
        strains = f"strain {t['strain at 60 %']:.2f} of {t['strain at the end']:.2f}"
        print(f"{knit} {along}: {strains}, {t['force at 60 %']:.1f} N at 60 %, scatter {t['scatter']:.0f} %")
        for name, row in t["predictions"].items():
            print("   ", name, ", ".join(f"{k} {v:+.1f}" for k, v in row.items() if k != "curve"))
    for law in PARAMETERS:
        t = table[law]
        print(f"  {law}: cost {t['cost']:.1f}, {t['seconds']:.0f} s")
        show_estimates(t["estimates"])


def show_estimates(estimates):
    for name, e in estimates.items():
        ends = " to ".join("open" if end is None else f"{end:.3g}" for end in e["interval"])
        print(f"    {name} {e['value']:.3g} [{ends}] mesh {e['mesh']:.2g}: {e['verdict']}; {e['words']}")


def main():
    tables, folder = {}, Path("out/knit_uniaxial")
    folder.mkdir(parents=True, exist_ok=True)
    for knit in KNITS:
        tables[knit] = judged(knit)
        show(knit, tables[knit])
        (folder / "study.json").write_text(json.dumps(tables, indent=1) + "\n", encoding="utf-8")
    print("garter along x alone, linear")
    show_estimates(summary(alone("garter", "x")))


if __name__ == "__main__":
    main()
