"""The bare beam as a rod: what shear does to EI and to the errors, and whether the motion shows GA.

Run from the repository's root: python experiments/beam/shear.py. It prints the table of the README.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
import sheetbend as sb
from sheetbend.config import load
from sheetbend.quantities.quantities import product

CONFIG = Path(__file__).with_name("beam.toml")
SIDE, POISSON = 0.03, 0.5  # m, of the square section; silicone
SECOND_MOMENT = SIDE**4 / 12
SHEAR = 5 / 6 / (2 * (1 + POISSON)) * 12 / SIDE**2  # GA/EI of a rectangle, 1/m^2: 5/6 G A, G = E/(2 (1 + nu))
STRETCH = 12 / SIDE**2  # EA/EI
MODELS = {"no shear": None, "GA by the section": {"tied_to": "beam_EI", "factor": SHEAR}, "GA free": {}}
EI, DAMPING = 0.018225, 0.1 / (2 * np.pi * 7.7)  # N m^2 and s, where the fits start


def scene(section, gravity, sheared, pulled, links=10):
    """The beam of the configuration's [[scene.rope]] as a rod; `pulled` by a force at its tip, which lets go."""
    rod = {"EI": EI, "GJ": EI, "EA": STRETCH * EI, "bend_damping": DAMPING, "stretch_damping": DAMPING}
    if sheared:
        rod |= {"GA": SHEAR * EI, "shear_damping": DAMPING}
    out = sb.Scene("beam", gravity)
    clamp = sb.Grip.fixed(section.start, section.clamp_start, (0, 1, 0))
    options = {"length": section.length, "segments": links, "density": section.density, "start": clamp, "tilts": True}
    built = sb.add_rod(out, "beam", **options, **rod)
    if pulled:
        out.add_force([built.particles[-1]], np.zeros((2, 1, 3)), [0.0, 1e-6])
        out.add_quantity("pull_z", -0.3, "N", positive=False, scale=0.3)
        out.add_terms([product("force", 2, 1.0, {"pull_z": "identity"})])
    return out


def experiment(given, section, sheared, links=10):
    """One of the configuration's experiments with its rope made a rod."""
    made = scene(section, given.recording.gravity, sheared, given.start == "equilibrium", links)
    tip = sb.on_rope(made.ropes["beam"], section.length)
    return replace(given, scene=made, markers={k: tip.with_offset(m.offset) for k, m in given.markers.items()})


def fitted(study, shear, refine=True):
    """The fit of one model to the rest and the fall of the bare beam. The clamp's angle is free: the configuration's
    comes from a fit without shear."""
    section, own = study.config.scene.rope[0], [e for e in study.experiments if e.name in ("rest", "fall")]
    coarse, fine = ([experiment(e, section, shear is not None, links) for e in own] for links in (10, 20))
    parameters = {
        "beam_EI": {},
        "beam_EA": {"tied_to": "beam_EI", "factor": STRETCH},
        "beam_bend_damping": {},
        "beam_stretch_damping": {"tied_to": "beam_bend_damping"},
        "beam_start_tilt_2": {},
        "pull_z": {"private": True},
    }
    if shear is not None:
        parameters |= {"beam_GA": shear, "beam_shear_damping": {"tied_to": "beam_bend_damping"}}
    finer = sb.Refinement(finer=lambda: fine) if refine else None
    return sb.fit(coarse, parameters=parameters, profiles=False, refine=finer)


def line(name, fit):
    """EI with its interval, E, GA, the cost, and the errors of the rest and of the fall, fitted and held out."""
    rest, fall = (next(r for r in fit.result.recordings if r.name == part) for part in ("rest", "fall"))
    EI, GA = fit["beam_EI"], fit.values.get("beam_GA")
    shear = "" if GA is None else f"{GA:.3g} N"
    if name == "GA free":
        shear += f", {fit['beam_GA'].verdict}"
    return " | ".join(
        [
            name,
            f"{EI.value:.4f} N m^2, {EI.lower:.4f} to {EI.upper:.4f}",
            f"{EI.value / SECOND_MOMENT / 1e3:.0f} kPa",
            shear,
            f"{fit.result.cost:.2f}",
            *(f"{1e3 * error:.3f} mm" for error in (rest.rms, fall.rms, fall.held_out)),
        ]
    )


if __name__ == "__main__":
    study = load(CONFIG)
    print("model | EI | E | GA | cost | rest | fall | held out")
    for name, shear in MODELS.items():
        print(line(name, fitted(study, shear)), flush=True)
