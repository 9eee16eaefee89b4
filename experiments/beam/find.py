"""What beam.toml tells of a recording beside the beam itself, read off the recording: marker offsets, the first turning
point, the windows, and the frequency of the loss factor.

Run from the repository's root: python experiments/beam/find.py [RECORDING.npz --hung KG]. Without a recording it
compares both recordings of beam.toml with what stands there, and fits with what it found; with one it prints lines for
a [[recording]].
"""

import argparse
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import sheetbend as sb
from sheetbend.config import build, parse

CONFIG = Path(__file__).with_name("beam.toml")
TIP = ("tip1", "tip2", "tip3")
MOVED = 5e-4  # m: a tip that is still held has moved by less
TURN = 0.05  # of the motion: what the tip goes back by after a turning point
EFFECTIVE = 33.0 / 140.0  # of a cantilever's mass, as if at its tip (Rayleigh)
FALL, HELD_OUT, FIRST = 0.34, 1.0, 0.1  # s: fitted, predicted, and of a run whose pull alone is fitted
AFTER = 0.0015  # s, from the turning point to the window's start: no frame is nearer


@dataclass(frozen=True)
class Found:
    """Of one recording.

    Attributes:
        released: time of the last frame in which the tip is held, s.
        offsets: (3, 3) m of the tip's markers from the beam's end, along, across and up.
        turning: times of the tip's turning points after the release, s; it starts at rest at the first.
    """

    released: float
    offsets: np.ndarray
    turning: np.ndarray

    @property
    def frequency(self):
        """Hz, from the turning points within the fitted window, half a period apart."""
        seen = self.turning[self.turning <= self.turning[0] + FALL]
        return (len(seen) - 1) / 2.0 / (seen[-1] - seen[0])


def found(recording, rope):
    """`rope`: start, direction and length of the beam, straight while it is held."""
    x = np.stack([recording.positions[:, recording.markers.index(name)] for name in TIP], axis=1)
    first = x[: max(3, len(x) // 50)].mean(axis=0)
    moved = np.linalg.norm(x - first, axis=-1).max(axis=1) > MOVED
    last = int(np.argmax(moved)) - 1
    end, direction = np.array(rope.start) + rope.length * np.array(rope.direction), np.array(rope.direction)
    normal = np.array(rope.plane)
    frame = np.array([direction, normal, np.cross(direction, normal)])
    return Found(
        float(recording.times[last]),
        (np.median(x[: last + 1], axis=0) - end) @ frame.T,
        turning_points(recording.times[last:], x[last:, :, 2].mean(axis=1)),
    )


def turning_points(times, z):
    """Times at which z turns, each by the parabola through its three frames; a start that falls counts from its first
    low. Going back by less than 5 % of the whole range is no turn."""
    least, extreme, falling, turns = TURN * np.ptp(z), 0, True, []
    for k in range(len(z)):
        if (z[k] <= z[extreme]) if falling else (z[k] >= z[extreme]):
            extreme = k
        elif abs(z[k] - z[extreme]) > least:
            turns.append(extreme)
            extreme, falling = k, not falling
    inner = [k for k in turns if 0 < k < len(z) - 1]
    low, mid, high = (z[np.array(inner) + d] for d in (-1, 0, 1))
    shift = 0.5 * (low - high) / (low - 2.0 * mid + high)
    return times[inner] + shift * np.gradient(times)[inner]


def loaded_frequency(bare, beam_mass, hung):
    """Hz of the bare beam's frequency with a mass (kg) at its tip, without a look at the loaded run."""
    tip = EFFECTIVE * beam_mass
    return bare * np.sqrt(tip / (tip + hung))


def lines(name, one, bare, beam_mass, hung):
    """A [[recording]] for beam.toml."""
    start = one.turning[0]
    frequency = bare if hung == 0 else loaded_frequency(bare, beam_mass, hung)
    first = FALL if hung == 0 else FIRST
    rows = "\n".join(
        f'  {{ marker = "{marker}", arc_length = 0.1, offset = [{", ".join(f"{v:.5f}" for v in offset)}] }},'
        for marker, offset in zip(TIP, one.offsets, strict=True)
    )
    begin = start + AFTER
    return (
        f'[[recording]]\nname = "{name}"\nstart = "equilibrium"\nstart_time = {start:.4f}\n'
        f"fit = [{begin:.4f}, {begin + first:.4f}]\nheld_out = [{begin + first:.4f}, {begin + first + HELD_OUT:.4f}]\n"
        f"values = {{ beam_loss_frequency = {frequency:.2f} }}\nmarker = [\n{rows}\n]"
    )


def of_config():
    """Found for each recording of beam.toml, and the configuration with what was found."""
    config = parse(CONFIG)
    rope = config.scene.rope[0]
    mass = rope.density * rope.length
    told = {section.name: section for section in config.recording}
    here = {name: found(sb.Recording.load(CONFIG.parent / s.file), rope) for name, s in told.items()}
    bare = here["fall"].frequency
    frequencies = dict.fromkeys(here, bare) | {"loaded": loaded_frequency(bare, mass, config.scene.point_mass[0].mass)}
    return config, here, frequencies


def with_found(config, here, frequencies):
    """The configuration with turning points, offsets and frequencies as they were found; windows move along."""
    recordings = []
    for section in config.recording:
        one, update = here[section.name], {}
        markers = [
            m.model_copy(update={"offset": o.tolist()}) for m, o in zip(section.marker, one.offsets, strict=True)
        ]
        if section.start_time is not None:
            shift = float(one.turning[0]) - section.start_time
            update["start_time"] = float(one.turning[0])
            update |= {w: [t + shift for t in getattr(section, w)] for w in ("fit", "held_out")}
        if section.values:
            update["values"] = section.values | {"beam_loss_frequency": float(frequencies[section.name])}
        recordings.append(section.model_copy(update={"marker": markers, **update}))
    rope = config.scene.rope[0].model_copy(update={"loss_frequency": float(frequencies["fall"])})
    scene = config.scene.model_copy(update={"rope": [rope]})
    return config.model_copy(update={"recording": recordings, "scene": scene})


def show_fit(title, config):
    study = build(config, CONFIG.parent)
    fit = sb.fit(study.experiments, parameters=study.parameters, **study.options)
    e = fit["beam_EI"]
    rows = ", ".join(f"{r.name} {1e3 * (r.held_out or r.rms):.2f} mm" for r in fit.result.recordings)
    loss = fit.values["beam_loss_factor"]
    print(f"{title}: EI {e.value:.5f} +- {e.half_width:.5f} N m^2, loss factor {loss:.3f}; {rows}")


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("recording", type=Path, nargs="?")
    parser.add_argument("--hung", type=float, default=0.0, help="mass at the tip, kg")
    given = parser.parse_args()
    config, here, frequencies = of_config()
    rope = config.scene.rope[0]
    if given.recording is not None:
        one = found(sb.Recording.load(given.recording), rope)
        print(lines(given.recording.stem, one, frequencies["fall"], rope.density * rope.length, given.hung))
        return
    for section in config.recording:
        one = here[section.name]
        off = 1e3 * np.abs(one.offsets - [m.offset for m in section.marker]).max()
        turn = f"turns at {one.turning[0]:.4f} s (there {section.start_time})" if section.start_time else "at rest"
        print(f"{section.name}: held until {one.released:.2f} s, {turn}, offsets within {off:.2f} mm of those there")
    print(f"loss frequencies: bare {frequencies['fall']:.2f} Hz (there {rope.loss_frequency}),", end=" ")
    print(f"loaded {frequencies['loaded']:.2f} Hz (there {config.recording[-1].values['beam_loss_frequency']})")
    show_fit("as typed", config)
    show_fit("as found", with_found(config, here, frequencies))


if __name__ == "__main__":
    main()
