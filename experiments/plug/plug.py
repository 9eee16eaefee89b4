"""A cable that swings with a plug at its end: stiffness of the cable, mass and center of the plug, from one motion.

    python experiments/plug/plug.py [--draws 1]

The recording comes from a cable of twice as many links and half the substep, with noise of 0.5 mm on every marker.
Each draw of the noise is fitted; then the first one again without the plug.
"""

from __future__ import annotations

import argparse

import numpy as np
import sheetbend as sb

LENGTH, DENSITY, SEGMENTS, H = 0.5, 0.1, 30, 1 / 500  # m, kg/m, links and s of the fit
NOISE, FITTED, SECONDS = 5e-4, 1.0, 1.5  # m, s, s
TIMES = np.arange(76) / 50.0  # s
TRUTH = {
    "cable_EI": 0.02,
    "cable_GJ": 0.01,
    "plug_mass": 0.08,
    "plug_center_x": 0.003,
    "plug_center_y": 0.002,
    "plug_center_z": -0.004,
    "cable_bend_damping": 0.01,
    "cable_twist_damping": 0.02,
}
MOMENTS = (2e-5, 3e-5, 4e-5)  # kg m^2, taken as known
BEGIN = (1.3, 0.7, 1.3, 0.0, 0.0, 0.0, 0.5, 0.5)  # times the truth, where the fit starts
PLACE = np.array([-0.02, 0.0, 0.0])  # m, where the cable enters the plug
CORNERS = np.array([[0.02, 0.01, 0.01], [0.02, -0.01, -0.01], [-0.02, 0.01, -0.01], [-0.02, -0.01, 0.01]])
ON_CABLE = 5  # markers


def hand() -> sb.Grip:
    """The grip at the start of the cable, which moves it about and rolls it."""
    t = np.arange(round(SECONDS * 200) + 1) / 200.0
    sway = 1.0 - np.cos(2.0 * np.pi * np.outer(t, [0.9, 1.3, 1.1, 1.7]))
    places = sway[:, :3] * [-0.03, 0.04, 0.03]
    half = 0.4 * sway[:, 3]
    return sb.Grip.from_poses(t, places, np.column_stack([np.sin(half), 0 * half, 0 * half, np.cos(half)]))


def model(segments: int, plugged: bool = True, values: dict[str, float] = TRUTH) -> tuple[sb.Scene, list[sb.Place]]:
    """The cable, clamped level at its start, and where its markers are: on the cable, then on the plug."""
    scene = sb.Scene("plug on a cable")
    end = None
    if plugged:
        center = [values[f"plug_center_{a}"] for a in "xyz"]
        given = {"mass": values["plug_mass"], "inertia": MOMENTS, "center": center}
        plug = scene.add_body("plug", at=[LENGTH, 0.0, 0.0] - PLACE, **given)
        end = plug.point(PLACE, along=(1.0, 0.0, 0.0))
    cable = sb.add_rod(
        scene,
        "cable",
        length=LENGTH,
        segments=segments,
        density=DENSITY,
        EI=values["cable_EI"],
        GJ=values["cable_GJ"],
        EA=2e3,
        bend_damping=values["cable_bend_damping"],
        twist_damping=values["cable_twist_damping"],
        start=hand(),
        end=end,
    )
    places = list(sb.along_rope(cable, ON_CABLE + 2)[1:-1])
    return scene, [*places, *sb.on_body(plug, CORNERS)] if plugged else places


def shown(x: np.ndarray, places: list[sb.Place]) -> np.ndarray:
    """(frames, markers, 3) m, where the markers are at positions (frames, nodes, 3) of the scene."""
    return np.stack([_one(x, place) for place in places], axis=1)


def _one(x: np.ndarray, place: sb.Place) -> np.ndarray:
    if place.body is None:
        return np.asarray(np.einsum("k,fkx->fx", place.weights, x[:, list(place.particles)]))
    origin, frame = place.body.pose(x)
    return origin + frame @ np.array(place.offset)


def swing(segments: int = SEGMENTS) -> np.ndarray:
    """(frames, markers, 3) m, the motion of a cable twice as fine."""
    scene, places = model(2 * segments)
    return shown(sb.simulate(scene, TIMES, sb.Solver(h=H / 2)).nodes, places)


def recorded(clean: np.ndarray, rng: np.random.Generator) -> sb.Recording:
    """With noise, as a camera sees it."""
    return sb.Recording(clean + NOISE * rng.standard_normal(clean.shape), TIMES, name="swing")


def experiment(recording: sb.Recording, segments: int = SEGMENTS, plugged: bool = True) -> sb.Experiment:
    """From where the fit starts. Without the plug the markers on the cable alone count."""
    begin = {name: value * share for (name, value), share in zip(TRUTH.items(), BEGIN, strict=True)}
    scene, places = model(segments, plugged, begin)
    seen = sb.Recording(recording.positions[:, : len(places)], recording.times, name=recording.name)
    return sb.Experiment(
        scene=scene,
        recording=seen,
        markers=places,
        solver=sb.Solver(h=H),
        fit=(0.0, FITTED),
        held_out=(FITTED, SECONDS),
        start_time=0.0,
        sigma=NOISE,
    )


def fitted(recording: sb.Recording, plugged: bool = True, segments: int = SEGMENTS) -> sb.Fit:
    """The numbers of `TRUTH` that the model has, with what a mesh twice as fine moves."""
    names = [name for name in TRUTH if plugged or name in ("cable_EI", "cable_bend_damping")]
    finer = sb.Refinement(finer=lambda: [experiment(recording, 2 * segments, plugged)], linear=True)
    return sb.fit(experiment(recording, segments, plugged), parameters=names, refine=finer)


def main(draws: int) -> None:
    clean, rng = swing(), np.random.default_rng(1)
    inside = dict.fromkeys(TRUTH, 0)
    first = recorded(clean, rng)
    for draw in range(draws):
        result = fitted(first if draw == 0 else recorded(clean, rng))
        for name, value in TRUTH.items():
            one = result[name]
            inside[name] += one.lower is not None and one.upper is not None and one.lower <= value <= one.upper
            if draw == 0:
                width = np.inf if one.half_width is None else one.half_width
                print(f"{name:20s} {value:8.4g}  fitted {one.value:9.5g} +- {width:8.2g}  {one.verdict}")
    print(f"intervals that hold the truth, of {draws}: {inside}")
    without = fitted(first, plugged=False)
    off = without["cable_EI"].value / TRUTH["cable_EI"] - 1
    print(f"without the plug: EI is off by {off:+.0%}, {without['cable_EI'].verdict}")
    for warning in without.result.warnings:
        print(f"  {warning}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--draws", type=int, default=1)
    main(parser.parse_args().draws)
