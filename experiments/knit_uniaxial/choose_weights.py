"""Weights and law of fits that are to be carried on, chosen within the fitted range.

Fits up to 40 % of the range of strain are judged on the same repeats from there to 60 %; what study.py holds out has no
part in it. Run from the repository's root: python experiments/knit_uniaxial/choose_weights.py; it prints a row per
choice.
"""

import numpy as np
from knits import DIRECTIONS, FITTED, KNITS, Weights, read
from study import REST, curve, errors, fitted, law_of, percent

WITHIN = 0.4
CHOICES = [
    (law, Weights(emphasis, sides))
    for law, sides in (("exponential", 1.0), ("exponential", 4.0), ("sinh", 4.0))
    for emphasis in (0.0, 1.0, 2.0, 3.0)
]


def within(knit, law, weights):
    """Error of the force from 40 to 60 % of the range, rms, %, of both directions."""
    pulls = [read(knit, along, WITHIN) for along in DIRECTIONS]
    fit, found = fitted(knit, law, share=WITHIN, weights=weights), []
    for pull in pulls:
        s = pull.fitted + REST * (read(knit, pull.along).fitted - pull.fitted)
        found.append(percent(errors(pull, curve(pull, law_of(law, pulls), fit.values)[0], s, FITTED)))
    return found


def main():
    print("law, emphasis, sides: median of the pulls;", ", ".join(f"{k} {a}" for k in KNITS for a in DIRECTIONS))
    for law, weights in CHOICES:
        found = [error for knit in KNITS for error in within(knit, law, weights)]
        each = " ".join(f"{error:.1f}" for error in found)
        print(f"{law}, {weights.emphasis:g}, {weights.sides:g}: {np.median(found):.1f}; {each}", flush=True)


if __name__ == "__main__":
    main()
