"""Three rigid bodies on hinges, as twins of a triple pendulum: inertia, centers and viscosities from swings.

    python experiments/triple_pendulum/triple.py [--draws 1] [--dry] [--known] [--first 0.3]

The recordings come from the equations of Lagrange in the three angles, integrated by an explicit method of eighth
order, not from the simulator. Each draw of the noise is fitted to two pieces, and two others are predicted from their
first samples (--first, in s). With --dry the hinges have dry friction in place of viscosity. With --known the pieces
are predicted from the same first samples with the true numbers: what is left of the error comes from the start.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable

import numpy as np
import sheetbend as sb
from scipy.integrate import solve_ivp

MASS, LENGTH = np.array([0.23, 0.25, 0.22]), np.array([0.17, 0.17, 0.17])  # kg, m from hinge to hinge
CENTER, MOMENT = np.array([0.10, 0.10, 0.08]), np.array([1.0e-3, 1.1e-3, 0.9e-3])  # m, kg m^2 about the centers
VISCOSITY = np.array([4e-4, 3e-4, 3e-4])  # N m s/rad
FRICTION, SLIP = np.array([2e-3, 1.5e-3, 1e-3]), 1e-3  # N m; rad, up to which a dry hinge gives elastically
NOISE = 3e-4  # m, of each coordinate of a marker
RATE, SECONDS, FIRST = 100, 1.5, 0.3  # Hz; s of a piece; s from which a piece is predicted
STARTS = {  # rad and rad/s of each arm, from straight down
    "fitted 1": [0.9, 0.6, 1.2, 0.0, 1.0, -2.0],
    "fitted 2": [-0.7, -1.3, -0.4, 2.0, -1.0, 0.0],
    "predicted 1": [1.2, 0.8, 0.5, -1.0, 0.0, 1.5],
    "predicted 2": [0.4, -0.9, -1.2, 0.0, 1.0, 0.0],
}
SOLVERS = {"viscosity": sb.Solver(h=1 / 200, extrapolate=3), "friction": sb.Solver(h=1 / 4800)}
"""By what the hinges have: extrapolation in time refuses dry friction, which is not smooth."""
BEGIN = (1.3, 0.8, 1.3, 0.9, 1.1, 2.0, 0.5, 2.0)  # times the truth, where the fit starts
OFF = np.full(6, 0.03)  # rad and rad/s, by which angles and rates are off where the fit starts
OWN = {f"hinge{k}_{key}": unit for key, unit in (("angle", "rad"), ("rate", "rad/s")) for k in range(3)}
PLACES = [(0.5, 0.02), (1.0, 0.0)]  # of markers, in parts of an arm's length and m across it


def truth(law: str) -> dict[str, float]:
    """What a swing shows beside the masses and the last arm's center, which set the scale."""
    resists = FRICTION if law == "friction" else VISCOSITY
    return {
        **{f"arm{k}_inertia_3": MOMENT[k] for k in range(3)},
        "arm0_center_x": CENTER[0],
        "arm1_center_x": CENTER[1],
        **{f"hinge{k}_{law}": resists[k] for k in range(3)},
    }


def slope(y: np.ndarray, resists: np.ndarray) -> np.ndarray:
    """Rates of angles and rates under the torques (3,) with which the hinges resist."""
    angles, rates = y[:3], y[3:6]
    arms = np.tril(np.tile(LENGTH, (3, 1)), -1) + np.diag(CENTER)  # of each center, to each angle
    coupled = np.einsum("i,ij,ik->jk", MASS, arms, arms)
    apart = angles[:, None] - angles
    torque = -(coupled * np.sin(apart)) @ rates**2 - 9.81 * (MASS @ arms) * np.sin(angles) - resists
    torque[:-1] += resists[1:]
    return np.concatenate([rates, np.linalg.solve(coupled * np.cos(apart) + np.diag(MOMENT), torque)])


def relative(rates: np.ndarray) -> np.ndarray:
    return np.diff(rates, prepend=0.0)


def swing(start: list[float], law: str) -> np.ndarray:
    """(frames, 3) rad, the angles of a piece."""
    t = np.arange(round(SECONDS * RATE) + 1) / RATE
    if law == "friction":
        return dry_swing(start, t)
    found = solve_ivp(
        lambda _, y: slope(y, VISCOSITY * relative(y[3:])), (0.0, SECONDS), start,
        method="DOP853", t_eval=t, rtol=1e-12, atol=1e-12,
    )  # fmt: skip
    return np.asarray(found.y[:3].T)


def dry_swing(start: list[float], t: np.ndarray) -> np.ndarray:
    """The same with dry friction: each hinge has given elastically by y[6:], up to SLIP, and slides beyond. Integrated
    from one change to the next."""
    y, at, slides, angles = np.concatenate([start, np.zeros(3)]), 0.0, np.zeros(3, dtype=bool), np.empty((len(t), 3))

    def changes(k: int) -> Callable[[float, np.ndarray], float]:
        def event(_: float, y: np.ndarray) -> float:
            onward = relative(y[3:6])[k] * np.sign(y[6 + k])
            return float(onward if slides[k] else SLIP - abs(y[6 + k]))

        event.terminal, event.direction = True, -1.0  # type: ignore[attr-defined]
        return event

    def moves(_: float, y: np.ndarray) -> np.ndarray:
        return np.concatenate([slope(y, FRICTION / SLIP * y[6:]), np.where(slides, 0.0, relative(y[3:6]))])

    events = [changes(k) for k in range(3)]
    while at < SECONDS:
        piece = solve_ivp(
            moves, (at, SECONDS), y, method="DOP853", events=events, dense_output=True,
            rtol=1e-11, atol=1e-12, max_step=5e-3,
        )  # fmt: skip
        at, y = piece.t[-1], piece.y[:, -1]
        for frame in np.flatnonzero((t >= piece.t[0]) & (t <= at)):
            angles[frame] = piece.sol(t[frame])[:3]
        for k in (k for k in range(3) if len(piece.t_events[k])):
            slides[k] = not slides[k]
            y[6 + k] = np.sign(y[6 + k]) * SLIP * (1.0 if slides[k] else 1.0 - 1e-12)
    return angles


def along(angles: np.ndarray) -> np.ndarray:
    return np.stack([np.sin(angles), 0.0 * angles, -np.cos(angles)], axis=-1)


def markers(angles: np.ndarray) -> np.ndarray:
    """(frames, 6, 3) m."""
    d, across = along(angles), along(angles + np.pi / 2.0)
    tops = np.cumsum(LENGTH[:, None] * d, axis=1) - LENGTH[:, None] * d
    on = [tops + part * LENGTH[:, None] * d + off * across for part, off in PLACES]
    return np.stack(on, axis=2).reshape(len(angles), -1, 3)


def scene_of(start: np.ndarray, values: dict[str, float], law: str) -> tuple[sb.Scene, list[sb.Place]]:
    """Three bodies on hinges about y, and where their markers are."""
    scene, top, upper, places = sb.Scene("triple pendulum"), np.zeros(3), None, []
    rates = relative(start[3:])
    for k in range(3):
        d, across = along(start[k]), along(start[k] + np.pi / 2.0)
        moment = values[f"arm{k}_inertia_3"]
        arm = scene.add_body(
            f"arm{k}",
            mass=MASS[k],
            inertia=[1e-3, 1e-3, moment],
            center=(values.get(f"arm{k}_center_x", CENTER[k]), 0.0, 0.0),
            at=top,
            rotation=np.stack([d, across, [0.0, -1.0, 0.0]], axis=1),
        )
        resists = {law: values[f"hinge{k}_{law}"]} | ({"slip_angle": SLIP} if law == "friction" else {})
        sb.hinge(upper, arm, at=top, axis=(0.0, -1.0, 0.0), name=f"hinge{k}", rate=rates[k], **resists)
        upper, top = arm, top + LENGTH[k] * d
        places += sb.on_body(arm, [(part * LENGTH[k], off, 0.0) for part, off in PLACES])
    return scene, places


def experiment(name: str, x: np.ndarray, law: str, known: bool, first: float) -> sb.Experiment:
    """A piece; of one that is predicted, the first samples alone are data."""
    begin = truth(law)
    if not known:
        begin = {key: value * share for (key, value), share in zip(begin.items(), BEGIN, strict=True)}
    scene, places = scene_of(np.array(STARTS[name]) + OFF, begin, law)
    seen = sb.Recording(x, np.arange(len(x)) / RATE, name=name)
    part = {"fit": (0.0, first), "held_out": (first, SECONDS)} if name.startswith("predicted") else {}
    return sb.Experiment(
        scene=scene, recording=seen, markers=places, solver=SOLVERS[law], start_time=0.0, sigma=NOISE, name=name, **part
    )


def fitted(pieces: dict[str, np.ndarray], law: str, known: bool = False, first: float = FIRST) -> sb.FitResult:
    """With the true numbers, or with those that the pieces show."""
    own = [sb.Parameter(name=name, private=True, unit=unit, scale=0.1) for name, unit in OWN.items()]
    experiments = [experiment(name, x, law, known, first) for name, x in pieces.items()]
    sought = [] if known else truth(law)
    return sb.fit(experiments, parameters=[*sought, *own], windows=[], refine=False, profiles=False)


def missed(result: sb.FitResult, clean: dict[str, np.ndarray], law: str, first: float = FIRST) -> dict[str, float]:
    """Of each predicted piece, the rms distance along one coordinate between predicted and noisy markers in the plane,
    after its first samples, over the noise."""
    found = {}
    for name, x in clean.items():
        if not name.startswith("predicted"):
            continue
        values = {key: result.values.get(key, value) for key, value in truth(law).items()}
        values |= {key: result.values[f"{key}[{name}]"] for key in OWN}
        scene, places = scene_of(np.array(STARTS[name]) + OFF, values, law)
        motion = sb.simulate(scene, np.arange(len(x)) / RATE, SOLVERS[law], {key: values[key] for key in OWN})
        x_found = []
        for place in places:
            origin, frame = place.body.pose(motion)
            x_found.append(origin + frame @ np.array(place.offset))
        off = (np.stack(x_found, axis=1) - x)[round(first * RATE) + 1 :, :, [0, 2]]
        found[name] = float(np.hypot(np.sqrt((off**2).mean()), NOISE) / NOISE)
    return found


def without_truth(result: sb.FitResult, law: str, told: bool) -> list[str]:
    """The numbers whose intervals do not hold the truth; all are printed where `told`."""
    outside = []
    for name, value in truth(law).items():
        one = result[name]
        holds = one.lower is not None and one.upper is not None and bool(one.lower <= value <= one.upper)
        outside += [] if holds else [name]
        if told:
            width = np.inf if one.half_width is None else one.half_width
            print(f"{name:18s} {value:8.4g}  fitted {one.value:9.5g} +- {width:8.2g}  {one.verdict}")
    return outside


def main(draws: int, law: str, known: bool, first: float) -> None:
    clean = {name: markers(swing(start, law)) for name, start in STARTS.items()}
    rng, off, outside = np.random.default_rng(1), [], []
    for draw in range(draws):
        noisy = {name: x + NOISE * rng.standard_normal(x.shape) for name, x in clean.items()}
        shown = {name: x for name, x in noisy.items() if not known or name.startswith("predicted")}
        result = fitted(shown, law, known, first)
        off.append(list(missed(result, clean, law, first).values()))
        told = ", ".join(f"{a:.2f}" for a in off[-1])
        words = f"draw {draw}: predicted pieces off by {told} times the noise"
        if not known:
            outside.append(without_truth(result, law, draw == 0))
            words += f"; intervals without the truth: {', '.join(outside[-1]) or 'none'}"
        print(words, flush=True)
    if not known:
        inside = {name: draws - sum(name in each for each in outside) for name in truth(law)}
        print(f"intervals that hold the truth, of {draws}: {inside}")
    print(f"predicted pieces within 1.2 times the noise: {(np.array(off) <= 1.2).sum()} of {np.size(off)}")
    print(f"largest error of a predicted piece: {np.max(off):.2f} times the noise")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--draws", type=int, default=1)
    parser.add_argument("--dry", action="store_true", help="dry friction in the hinges, not viscosity")
    parser.add_argument("--known", action="store_true", help="predict with the true numbers; nothing else is fitted")
    parser.add_argument("--first", type=float, default=FIRST, metavar="S", help="predict from so many seconds")
    given = parser.parse_args()
    main(given.draws, "friction" if given.dry else "viscosity", given.known, given.first)
