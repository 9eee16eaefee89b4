"""How well the first frames of a flight can tell where the middle between the blocks will be, without the simulator.

    python experiments/elbow/first_frames.py

The middle falls like a point, so what it differs from a straight line, after gravity, is noise of the recording. The
covariance of this noise over the frames of a flight is estimated by restricted maximum likelihood: a white part, a part
that stays for some frames (Matern 3/2), and one scale per axis. It gives the best linear unbiased estimate from the
first frames, and how far off that is. Each half of the flights is predicted with the covariance of the other half.
"""

from __future__ import annotations

import numpy as np
from blocks import RATE, SEEN, Flight, flights
from scipy.optimize import minimize
from turning_axes import turning

GRAVITY = 9.64  # m/s^2, in lengths of the data
DRAWS = 20_000
BEGIN = np.log([0.03, 0.08, 3.0, 1.0, 1.0])  # mm, mm, frames, and y and z over x
MOST = 2.0  # mm
Path = tuple[np.ndarray, np.ndarray]  # times (frames,) in frames, the middle without its fall (frames, 3) mm


def path(flight: Flight) -> Path:
    fall = 0.5 * np.outer(flight.times**2, [0.0, 0.0, -GRAVITY])
    return flight.times * RATE, 1e3 * (flight.middle() - fall)


def covariances(count: int, logs: np.ndarray) -> list[np.ndarray]:
    """(count, count) mm^2, of x, y and z."""
    white, kept, length, y, z = np.exp(logs)
    apart = np.sqrt(3.0) * np.abs(np.subtract.outer(np.arange(count), np.arange(count))) / length
    shape = white**2 * np.eye(count) + kept**2 * (1.0 + apart) * np.exp(-apart)
    return [shape, y**2 * shape, z**2 * shape]


def line(t: np.ndarray) -> np.ndarray:
    return np.stack([np.ones_like(t), t], axis=1)


def misfit(logs: np.ndarray, paths: list[Path]) -> float:
    """Minus the restricted log-likelihood of straight paths."""
    total = 0.0
    for t, x in paths:
        for k, V in enumerate(covariances(len(t), logs)):
            L = np.linalg.cholesky(V)
            A, b = np.linalg.solve(L, line(t)), np.linalg.solve(L, x[:, k])
            r = b - A @ np.linalg.lstsq(A, b, rcond=None)[0]
            total += np.log(np.diag(L)).sum() + 0.5 * np.linalg.slogdet(A.T @ A)[1] + 0.5 * r @ r
    return float(total)


def weights(t: np.ndarray, seen: int, V: np.ndarray) -> np.ndarray:
    """(seen,) of the first frames, in the estimate of the last one."""
    A, W = line(t)[:seen], np.linalg.inv(V[:seen, :seen])
    return np.asarray(line(t)[-1] @ np.linalg.solve(A.T @ W @ A, A.T @ W))


def off(path_: Path, seen: int, own: list[np.ndarray]) -> float:
    """mm, of the last frame."""
    t, x = path_
    return float(np.linalg.norm([weights(t, seen, V) @ x[:seen, k] - x[-1, k] for k, V in enumerate(own)]))


def spread(path_: Path, seen: int, noise: list[np.ndarray], own: list[np.ndarray]) -> np.ndarray:
    """(3,) mm: standard deviations of that error, where the weights are those of covariances `own`."""
    t = path_[0]
    found = []
    for V, W in zip(noise, own, strict=True):
        a = np.zeros(len(t))
        a[:seen], a[-1] = weights(t, seen, W), -1.0
        found.append(np.sqrt(a @ V @ a))
    return np.array(found)


def main() -> None:
    every = flights()
    middle = (len(every) + 1) // 2
    halves = [every[:middle], every[middle:]]
    rates = [turning([(f.times, f.middle(), ()) for f in half])[0] for half in halves]
    paths = [[path(f.steady(r)) for f in half] for half, r in zip(halves, rates[::-1], strict=True)]
    found = [minimize(misfit, BEGIN, args=(own,), method="Nelder-Mead", options={"maxiter": 800}).x for own in paths]
    for logs in found:
        white, kept, length, y, z = np.exp(logs)
        print(
            f"noise of x {white:.3f} mm white, {kept:.3f} mm over {length:.1f} frames; y {y:.2f} and z {z:.2f} times it"
        )
    print(f"largest errors of the middle at the last frame, from the first {SEEN} frames, mm")
    both = [
        (flight, own, logs)
        for half, lines, logs in zip(halves, paths, found[::-1], strict=True)
        for flight, own in zip(half, lines, strict=True)
    ]
    rows = []
    for flight, own, logs in both:
        V, flat = covariances(len(own[0]), logs), [np.eye(len(own[0]))] * 3
        expected = spread(own, SEEN, V, V)
        rows.append((off(own, SEEN, flat), off(own, SEEN, V), float(np.linalg.norm(expected)), flight.name))
    for plain, best, expected, name in sorted(rows, reverse=True)[:4]:
        print(f"  {name}: line {plain:.2f}, best weights {best:.2f}; expected {expected:.2f}")
    print(
        f"first frames | root mean square, of lines | largest of {len(both)}, median and 95 % | all within {MOST:g} mm"
    )
    rng = np.random.default_rng(1)
    noise = [(own, covariances(len(own[0]), logs)) for _, own, logs in both]
    for seen in (4, 5, 6, 8):
        sizes = np.array([spread(own, seen, V, V) for own, V in noise])
        lines = np.array([spread(own, seen, V, [np.eye(len(V[0]))] * 3) for own, V in noise])
        drawn = np.linalg.norm(sizes * rng.standard_normal((DRAWS, *sizes.shape)), axis=2).max(axis=1)
        low, high = np.percentile(drawn, [50.0, 95.0])
        mean, of_line = (np.sqrt((s**2).sum(axis=1).mean()) for s in (sizes, lines))
        within = (drawn < MOST).mean()
        print(f"{seen} | {mean:.3f} mm, {of_line:.3f} | {low:.2f}, {high:.2f} mm | {within:.1%}")


if __name__ == "__main__":
    main()
