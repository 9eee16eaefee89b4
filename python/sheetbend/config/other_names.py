"""Names that other programs and people give to the keys of a configuration, for errors about unknown keys."""

from __future__ import annotations

from collections.abc import Sequence

OTHER_NAMES = {
    "h": ("dt", "step", "time_step", "timestep", "substep"),
    "substeps": ("steps",),
    "iterations": ("sweeps",),
    "sigma": ("noise", "error", "accuracy", "sd", "std", "uncertainty"),
    "file": ("path", "filename", "data", "csv"),
    "fit": ("window", "range", "interval", "time_window", "train"),
    "held_out": ("test", "validation", "holdout"),
    "lower": ("min", "minimum", "lower_bound"),
    "upper": ("max", "maximum", "upper_bound"),
    "initial": ("value", "guess", "start", "init", "x0"),
    "name": ("title", "id"),
    "about": ("description", "comment"),
    "segments": ("elements", "links", "n", "resolution"),
    "EI": ("stiffness", "bending_stiffness", "bending"),
    "arc_length": ("s", "arclength", "at", "position"),
    "marker": ("label", "name"),
    "max_iterations": ("iterations", "maxiter", "max_iter"),
    "gravity": ("g",),
    "velocity": ("speed",),
    "friction": ("mu",),
}
"""By key, other names for it."""

MADE_OF = {
    "mass": ("density", "give density, the mass over the length in kg/m (of a cloth over the area, kg/m^2)"),
    "E": ("EI", "give EI = E * I in N m^2; of a round section of radius r, I = pi * r^4 / 4"),
    "youngs_modulus": ("EI", "give EI = E * I in N m^2; of a round section of radius r, I = pi * r^4 / 4"),
    "diameter": ("EI", "give EI = E * pi * diameter^4 / 64 in N m^2, and density in kg/m"),
    "bounds": ("lower", "write lower = ... and upper = ... on lines of their own"),
    "fps": ("h", "leave it out: times come from the recording; a JSON beside a file without times gives `rate`"),
    "frequency": ("h", "give h, the time of a substep in s, or `substeps` in each frame interval"),
}
"""By name, a key that is there only if this name can be meant, and how to write what is meant."""


def meant(name: str, known: Sequence[str]) -> str | None:
    """How to write what somebody calls by a name, where the keys `known` have it under another; None where they do
    not."""
    key, fix = MADE_OF.get(name, ("", ""))
    if key in known:
        return f"{fix}."
    found = next((key for key, others in OTHER_NAMES.items() if key in known and name.lower() in others), None)
    return None if found is None else f"did you mean '{found}'?"
