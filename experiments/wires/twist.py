"""The three wires as rods: EI from the hanging shapes again, and GJ/EI from the twist at which the loop snaps.

Run from the repository's root: python experiments/wires/twist.py. It prints its tables and writes them to
out/wires/twist.json; twist_figure.py draws twist.png from that file.
"""

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import sheetbend as sb

DATA = Path(__file__).parent / "data"
WIRES = ("white", "black", "red")
START_EI = {"white": 7e-5, "black": 1e-3, "red": 6.5e-4}  # N m^2
MODELS = {"EI alone": (False, False), "EI, angles": (True, False), "EI, angles, set": (True, True)}
LINKS = 100
STEP, SHORTEST = np.radians(20.0), np.radians(0.1)  # of the end's roll
SNAP = 0.03  # m, by which a node moves in a snap at least, and else only in a step that is too long
ACROSS = (0, 1, 0)  # the photographs' normal: the frames' first axis, about which angles, set and bending then are
STUDENT = 2.776  # 97.5 % quantile for five measurements


def recording(wire, shape):
    return sb.Recording.load(DATA / f"{wire}_{shape}.npz")


def gap(comparison):
    """Mean distance [m] between measured and simulated points; the two held ends do not count."""
    return np.linalg.norm(comparison.simulated - comparison.recording.positions, axis=-1).mean()


def hanging(wire, shape, EI, ratio, links=LINKS):
    """The wire in one photograph, between level holders; GJ = ratio EI."""
    photo = recording(wire, shape)
    points, given = photo.positions[0], photo.metadata
    start, end = (sb.Grip.fixed(points[k], (1, 0, 0), ACROSS) for k in (0, -1))
    scene = sb.Scene(wire)
    sb.add_rod(
        scene,
        wire,
        length=given["length_m"],
        segments=links,
        density=given["linear_density_kg_per_m"],
        EI=EI,
        GJ=ratio * EI,
        points=points,
        start=start,
        end=end,
        tilts=True,
        roll=True,
        curvature_modes=(1,),
    )
    return scene


def fitted(wire, angles, set_, links=LINKS):
    """EI of the wire's three shapes; also the holders' angles and the set where the model has them."""
    experiments = []
    for shape in range(3):
        scene = hanging(wire, shape, START_EI[wire], 1.0, links)
        rod = scene.ropes[wire]
        inner = [sb.on_rope(rod, s) for s in np.linspace(0.0, rod.length, 51)[1:-1]]
        places = [None, *inner, None]
        photo = recording(wire, shape)
        experiments.append(
            sb.Experiment(scene=scene, recording=photo, markers=places, static=True, sigma=0.01, axes="xz")
        )
    parameters = {f"{wire}_EI": {"lower": 1e-6, "upper": 1e-2}}
    if angles:
        angle = {"private": True, "lower": -1.0, "upper": 1.0, "prior": (0, 0.1745)}
        parameters |= {f"{wire}_{end}_tilt_2": angle for end in ("start", "end")}
    if set_:
        parameters[f"{wire}_curvature_2_1"] = {"prior": (0, 10)}
    return sb.fit(experiments, parameters=parameters, profiles=False)


@dataclass(frozen=True)
class Loop:
    """A wire as one photograph's fit has it, whose end is turned."""

    wire: str
    scene: sb.Scene
    values: dict

    @classmethod
    def of(cls, wire, shape, fit, links=LINKS):
        scene = hanging(wire, shape, START_EI[wire], 1.0, links)
        name = fit.comparisons[shape].experiment.name
        own = {q: fit.values.get(f"{q}[{name}]", fit.values.get(q)) for q in scene.quantities}
        return cls(wire, scene, {q: v for q, v in own.items() if v is not None})

    def turned(self, positions, by):
        """A start for the next roll: the directors turned about their edges, evenly along the wire."""
        rod, x = self.scene.ropes[self.wire], positions.copy()
        edges = np.diff(x[[rod.start_ghost, *rod.particles, rod.end_ghost]], axis=0)
        edges /= np.linalg.norm(edges, axis=1, keepdims=True)
        angle, q = np.linspace(0.0, by, len(edges))[:, None], x[rod.directors]
        x[rod.directors] = np.cos(angle) * q + np.sin(angle) * np.cross(edges, q)
        return x

    def path(self, EI, ratio):
        """Equilibria while the end is turned until the loop snaps: [(roll in rad, equilibrium), ...].

        The last roll is that of the snap within 0.1 degrees: a longer one leads to an unstable rest, to one that is
        far off, or to none.
        """
        values = {**self.values, f"{self.wire}_EI": EI, f"{self.wire}_GJ": ratio * EI}
        nodes = self.scene.ropes[self.wire].particles
        rest = sb.equilibrium(self.scene, values=values)
        found, step = [(0.0, rest)], STEP
        while step > SHORTEST and found[-1][0] < 8 * np.pi:
            roll, rest = found[-1]
            try:
                start, turned = self.turned(rest.nodes, step), {**values, f"{self.wire}_roll": roll + step}
                further = sb.equilibrium(self.scene, start, turned, stable=False)
                moved = np.linalg.norm((further.positions - rest.positions)[nodes], axis=1).max()
                holds = further.unstable_modes == 0 and moved < SNAP
            except sb.SheetbendError:
                holds = False
            if holds:
                found.append((roll + step, further))
            else:
                step /= 2
        return found


def critical(loops, EI, ratio):
    """Roll [degrees] at which each loop snaps."""
    return np.degrees([loop.path(EI, ratio)[-1][0] for loop in loops])


def ratio_of(loops, EI, measured):
    """The GJ/EI at which the loops snap at the measured roll [degrees] in their mean: secants of logarithms."""
    points = [(1.5, critical(loops, EI, 1.5).mean())]
    slope = -0.9  # d ln(critical)/d ln(ratio) is -1 for a ring without weight
    for _ in range(8):
        ratio, roll = points[-1]
        if abs(roll / measured - 1.0) < 1e-3:
            return ratio
        if len(points) > 1:
            before, roll_before = points[-2]
            slope = np.log(roll / roll_before) / np.log(ratio / before)
        ratio *= float(np.exp(np.clip(np.log(measured / roll) / slope, -1.0, 1.0)))
        points.append((ratio, critical(loops, EI, ratio).mean()))
    raise RuntimeError(f"no GJ/EI found for a critical twist of {measured:.0f} degrees; tried {points}")


def twist_of(wire, model, links=LINKS):
    """GJ/EI of a wire in one model, and what it hangs on."""
    fit = fitted(wire, *MODELS[model], links)
    EI = fit[f"{wire}_EI"]
    turned = np.array(recording(wire, 0).metadata["published"]["critical_twist_deg"], dtype=float)
    loops = [Loop.of(wire, shape, fit, links) for shape in range(3)]
    ratio = ratio_of(loops, EI.value, turned.mean())
    each = critical(loops, EI.value, ratio)
    by_ratio = np.log(critical(loops, EI.value, 1.1 * ratio).mean() / each.mean()) / np.log(1.1)
    by_EI = np.log(critical(loops, 1.1 * EI.value, ratio).mean() / each.mean()) / np.log(1.1)
    of_twist = STUDENT * turned.std(ddof=1) / np.sqrt(len(turned)) / turned.mean()
    of_EI = by_EI * 0.5 * np.log(EI.upper / EI.lower)
    half_width = float(np.hypot(of_twist, of_EI) / abs(by_ratio))
    return {
        "EI": EI.value,
        "EI_lower": EI.lower,
        "EI_upper": EI.upper,
        "gap_mm": 1e3 * float(np.mean([gap(c) for c in fit.comparisons])),
        "GJ_over_EI": ratio,
        "lower": ratio * float(np.exp(-half_width)),
        "upper": ratio * float(np.exp(half_width)),
        "GJ": ratio * EI.value,
        "critical_deg": each.tolist(),
        "percent_of_twist_per_percent_of_GJ": by_ratio,
        "percent_of_twist_per_percent_of_EI_and_GJ": by_EI,
        "ring_deg": float(np.degrees(2 * np.pi * np.sqrt(3.0)) / ratio),
    }


def as_published(wire):
    """Critical twist [degrees] of level holders and no set with the published EI (mean) and GJ/EI; and the GJ/EI that
    the measured twist needs at the published EI."""
    given = recording(wire, 0).metadata["published"]
    EI, ratio = float(np.mean(given["EI_N_m2"])), given["GJ_over_EI"]
    loops = [Loop(wire, hanging(wire, shape, EI, ratio), {}) for shape in range(3)]
    measured = np.mean(given["critical_twist_deg"])
    return {
        "EI": EI,
        "GJ_over_EI": ratio,
        "measured_deg": float(measured),
        "critical_deg": float(critical(loops, EI, ratio).mean()),
        "GJ_over_EI_here": ratio_of(loops, EI, measured),
    }


def turning(wire, EI, ratio):
    """Roll and torque of the first photograph's loop on the way to the snap, and some of its shapes, for the figure."""
    loop = Loop(wire, hanging(wire, 0, EI, ratio), {})
    path = loop.path(EI, ratio)
    nodes = loop.scene.ropes[wire].particles
    last = path[-1][0]
    shown = [min(path, key=lambda p: abs(p[0] - share * last)) for share in (0.0, 0.5, 1.0)]
    after = sb.equilibrium(
        loop.scene,
        path[-1][1].positions,
        {f"{wire}_EI": EI, f"{wire}_GJ": ratio * EI, f"{wire}_roll": last + np.radians(5)},
    )
    return {
        "roll_deg": [float(np.degrees(roll)) for roll, _ in path],
        "torque_Nm": [-float(rest.forces[f"{wire}_twist"][-1, 0]) for _, rest in path],
        "shapes": [rest.positions[nodes].tolist() for _, rest in (*shown, (0, after))],
    }


def pushing(wire, EI, ratio):
    """Rolls [degrees] at which the first photograph's loop, with its set, pushes its end on."""
    loop = Loop.of(wire, 0, fitted(wire, *MODELS["EI, angles, set"]))
    path = loop.path(EI, ratio)
    return [round(float(np.degrees(roll))) for roll, rest in path if rest.forces[f"{wire}_twist"][-1, 0] > 1e-9]


def main():
    tables = {}
    for wire in WIRES:
        table = {"published": as_published(wire)}
        print(wire, {k: round(v, 7) for k, v in table["published"].items()}, flush=True)
        for model in MODELS:
            table[model] = row = twist_of(wire, model)
            text = ", ".join(f"{k} {np.round(v, 3 if np.min(v) > 0.1 else 7)}" for k, v in row.items())
            print(f"  {model}: {text}", flush=True)
        finer = twist_of(wire, "EI alone", 2 * LINKS)
        table["moved_percent"] = {
            key: 100 * (finer[key] / table["EI alone"][key] - 1.0) for key in ("EI", "GJ_over_EI")
        }
        print(f"  twice the links move, %: {table['moved_percent']}", flush=True)
        with_set = table["EI, angles, set"]
        table["pushes_at_deg"] = pushing(wire, with_set["EI"], with_set["GJ_over_EI"])
        print(f"  with set, pushes on at {table['pushes_at_deg']} degrees", flush=True)
        table["turning"] = turning(wire, table["EI alone"]["EI"], table["EI alone"]["GJ_over_EI"])
        tables[wire] = table
    Path("out/wires").mkdir(parents=True, exist_ok=True)
    Path("out/wires/twist.json").write_text(json.dumps(tables, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
