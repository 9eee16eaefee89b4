"""Carries pulls on from 60 % of their strain with intervals, and counts how often unseen repeats lie inside.

Run from the repository's root: python experiments/knit_uniaxial/foresee.py [FOLDER]. Without a folder it takes the four
knits and then 200 synthetic yarns (a minute); a folder holds <name>_x.npz or _y.npz with their .json, as the source has
them or as reduce.py leaves them. Nothing of the strain beyond 60 %, and nothing of repeats 4 and 5, is fitted.
"""

import argparse
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from knits import DATA, FITTED, PRETENSION, SHARE, UNSEEN, read
from sheetbend import textile
from yarns import made

BEYOND = np.linspace(0.125, 1.0, 8)  # of the way from 60 % of the strain to its end
HALVES = {"60 to 80 %": slice(0, 4), "80 to 100 %": slice(4, 8)}
YARNS, SEED = 200, 2026


@dataclass(frozen=True)
class Judged:
    """One pull's forecast against its unseen repeats.

    Attributes:
        forecast: at eight strains from 60 % of the range to its end.
        inside: (repeats, strains) whether the force lies in the interval, NaN beyond a repeat's end.
        error: rms of the median forecast, % of the force.
        repeats: the same of the fitted repeats' own mean, which no forecast has.
    """

    forecast: textile.PullForecast
    inside: np.ndarray
    error: float
    repeats: float


def judged(repeats, fitted, end):
    """`repeats`: strain and force (N) of each, from the pretension on; `fitted`, `end`: strains."""
    known = [textile.Curve(f"repeat {k + 1}", "tension", *repeats[k], pretension=PRETENSION) for k in FITTED]
    strains = fitted + BEYOND * (end - fitted)
    reached = min(fitted, *(c.deformation[-1] for c in known))
    forecast = textile.forecast_pull(known, strains, up_to=float(reached))
    force = np.array([np.interp(strains, *repeats[k], right=np.nan) for k in UNSEEN])
    inside = np.where(np.isnan(force), np.nan, (force >= forecast.lower) & (force <= forecast.upper))
    own = np.array([np.interp(strains, *repeats[k], right=np.nan) for k in FITTED])
    mean = np.where(np.isnan(own).any(axis=0), np.nan, own.mean(axis=0))
    return Judged(forecast, inside, _rms(forecast.load / force - 1.0), _rms(mean / force - 1.0))


def _rms(values):
    return 100.0 * float(np.sqrt(np.nanmean(np.square(values)))) if not np.isnan(values).all() else np.nan


def recorded(folder=DATA):
    """Pulls of a folder, judged, by name."""
    found = {}
    for path in sorted([*folder.glob("*_x.npz"), *folder.glob("*_y.npz")]):
        knit, along = path.stem[:-2], path.stem[-1]
        pull = read(knit, along, SHARE, folder)
        found[f"{knit} {along}"] = judged(
            [(r.strain, r.force + PRETENSION) for r in pull.repeats], pull.fitted, pull.end
        )
    return found


def synthetic(count=YARNS, seed=SEED):
    return {f"yarn {k}": judged(p.repeats, SHARE * p.end, p.end) for k, p in enumerate(made(count, seed))}


def counted(found):
    """Part of the unseen forces inside, and median half-width in % of the forecast, of both halves and of all."""
    inside = np.array([one.inside for one in found.values()])
    width = np.array([one.forecast.half_width for one in found.values()])
    parts = HALVES | {"all": slice(0, 8)}
    return {
        name: (float(np.nanmean(inside[..., part])), 100.0 * float(np.median(width[:, part])))
        for name, part in parts.items()
    }


def show(title, found):
    errors = [one.error for one in found.values()]
    print(f"{title}: error of the forecast, mean {np.mean(errors):.1f} %, median {np.median(errors):.1f} %")
    print(f"  the fitted repeats' own mean there: {np.nanmean([one.repeats for one in found.values()]):.1f} %")
    for part, (inside, width) in counted(found).items():
        print(f"  {part}: {inside:.1%} inside, median half-width {width:.0f} %")
    shares = [one.forecast.shares for one in found.values()]
    print("  shares of the laws:", ", ".join(f"{n} {np.mean([s[n] for s in shares]):.0%}" for n in shares[0]))


def show_each(found):
    for name, one in found.items():
        widths = 100.0 * one.forecast.half_width
        halves = ", ".join(
            f"{part} {np.nanmean(one.inside[:, cut]):.0%} inside +- {np.median(widths[cut]):.0f} %"
            for part, cut in HALVES.items()
        )
        print(f"{name}: error {one.error:.0f} %, repeats {one.repeats:.0f} %; {halves}")


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, nargs="?", default=DATA)
    folder = parser.parse_args().folder
    found = recorded(folder)
    show_each(found)
    show(f"{len(found)} recorded pulls", found)
    if folder == DATA:
        show(f"{YARNS} synthetic yarns", synthetic())


if __name__ == "__main__":
    main()
