"""How well any unbiased estimate predicts the pieces of `triple.py` from their first samples: the bound of Cramer and
Rao, without the simulator.

    python experiments/triple_pendulum/bound.py [--dry]

The derivatives of the markers with respect to starts and numbers are central differences of the equations of Lagrange.
They give the covariance of the best estimate, and draws from it the errors of predicted pieces.
"""

from __future__ import annotations

import argparse

import numpy as np
import triple
from triple import NOISE, RATE, SECONDS, STARTS

LENGTHS = (0.2, 0.3, 0.4, 0.5, 0.6)  # s, from which pieces are predicted
DRAWS, SEED = 20_000, 1
STEP = 1e-4  # of numbers, relative; of starts, rad and rad/s


def path(start: np.ndarray, numbers: np.ndarray, law: str) -> np.ndarray:
    """Coordinates in the plane (frames, 12) m of the markers of a piece."""
    triple.MOMENT, (triple.CENTER[0], triple.CENTER[1]) = numbers[:3], numbers[3:5]
    setattr(triple, "FRICTION" if law == "friction" else "VISCOSITY", numbers[5:])
    x = triple.markers(triple.swing(start.tolist(), law))[:, :, [0, 2]]
    return x.reshape(len(x), -1)


def derivatives(start: np.ndarray, numbers: np.ndarray, law: str) -> np.ndarray:
    """(frames, 12, 6 + numbers) of a piece, with respect to its start and the numbers."""
    at, columns = np.concatenate([start, numbers]), []
    for k in range(len(at)):
        step = STEP * (1.0 if k < 6 else at[k])
        ends = []
        for sign in (1.0, -1.0):
            moved = at.copy()
            moved[k] += sign * step
            ends.append(path(moved[:6], moved[6:], law))
        columns.append((ends[0] - ends[1]) / (2.0 * step))
    path(start, numbers, law)  # leaves the true numbers behind
    return np.stack(columns, axis=-1)


def main(law: str) -> None:
    numbers = np.array(list(triple.truth(law).values()))
    count = len(numbers)
    found = {name: derivatives(np.array(start), numbers, law) for name, start in STARTS.items()}
    names, rng = list(found), np.random.default_rng(SEED)
    print(f"hinges with {law}: predicted pieces within 1.2 times the noise, of 40, and the median")
    print("first samples | numbers known | numbers fitted")
    for seconds in LENGTHS:
        frames = round(seconds * RATE) + 1
        information = np.zeros((6 * len(names) + count, 6 * len(names) + count))
        for k, name in enumerate(names):
            own = [*range(6 * k, 6 * k + 6), *range(6 * len(names), 6 * len(names) + count)]
            J = found[name][: frames if name.startswith("predicted") else None].reshape(-1, 6 + count) / NOISE
            information[np.ix_(own, own)] += J.T @ J
        errors = rng.standard_normal((DRAWS, len(information))) @ np.linalg.cholesky(np.linalg.inv(information)).T
        words = []
        for known in (True, False):
            off = []
            for k, name in enumerate(names):
                if not name.startswith("predicted"):
                    continue
                J = found[name][frames:].reshape(-1, 6 + count)[:, : 6 if known else None]
                if known:
                    own = slice(6 * k, 6 * k + 6)
                    spread = np.linalg.cholesky(np.linalg.inv(information[own, own]))
                    e = rng.standard_normal((DRAWS, 6)) @ spread.T
                else:
                    e = errors[:, [*range(6 * k, 6 * k + 6), *range(6 * len(names), len(information))]]
                square = np.einsum("dk,kl,dl->d", e, J.T @ J / len(J), e)
                off.append(np.sqrt(square / NOISE**2 + 1.0))
            every = np.concatenate(off)
            scatter = np.sqrt(20.0) * (np.stack(off) <= 1.2).sum(axis=0).std()  # of 20 draws of two pieces
            words.append(f"{40 * (every <= 1.2).mean():.1f} +- {scatter:.1f}, {np.median(every):.2f}")
        print(f"{seconds:.1f} s of {SECONDS:g} | {words[0]} | {words[1]}", flush=True)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--dry", action="store_true", help="dry friction in the hinges, not viscosity")
    main("friction" if parser.parse_args().dry else "viscosity")
