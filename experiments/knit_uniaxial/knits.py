"""The knits' recordings, and the sheets that are to explain them. Lengths are in clamp widths, forces in N."""

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import sheetbend as sb
from reduce import reduced
from scipy.optimize import isotonic_regression
from sheetbend.mesh import grid

DATA = Path(__file__).parent / "data"
KNITS = ("garter", "rib", "seed", "stockinette")
DIRECTIONS = ("x", "y")
FITTED, UNSEEN = (0, 1, 2), (3, 4)  # repeats
SHARE = 0.6  # of the range of extension, from slack to the end: what is fitted
LEVELS = (0.2, 0.4, 0.6, 0.8, 1.0)  # of the strain from the pretension to there: one equilibrium each
PRETENSION = 1.0  # N: a sheet's shape under it counts as its shape at rest
RIGHT, LEFT, BOTTOM, TOP, CENTER, LOW_CLAMP, HIGH_CLAMP = range(7)
SPREAD = 0.05  # of the fitted strain: what repeats differ by
CELLS = 48  # nearly square; an even number each way, so that a vertex is in the middle
FLAT = 1.0  # N m, bending: it keeps the sheet in its plane and does nothing within it


@dataclass(frozen=True)
class Weights:
    """What the law, which is not the knit's, may miss by more than repeats differ: smaller loads, by this power of the
    largest fitted force over theirs, and the distance of the side pins, by a factor."""

    emphasis: float
    sides: float


EVEN = Weights(0.0, 1.0)  # what repeats differ by, and no more


@dataclass(frozen=True)
class Repeat:
    """One pull: strain of the pins top and bottom, force above the pretension (rising), and how far the sides have come
    in, each (n,); length and width between the pins under the pretension."""

    strain: np.ndarray
    force: np.ndarray
    narrowing: np.ndarray
    length: float
    width: float

    def force_at(self, strain):
        """NaN beyond the end."""
        return np.interp(strain, self.strain, self.force, right=np.nan)

    def strain_at(self, force):
        return np.interp(force, self.force, self.strain, right=np.nan)

    def narrowing_at(self, strain):
        return np.interp(strain, self.strain, self.narrowing, right=np.nan)


@dataclass(frozen=True)
class Pull:
    """A knit pulled along one direction.

    Strains count from the pretension: `fitted` is the largest that is fitted, `end` the largest at all. Length and
    width are those of the sheet between its clamps under the pretension."""

    name: str
    along: str
    repeats: tuple[Repeat, ...]
    fitted: float
    end: float
    length: float
    width: float

    def loads(self):
        """Forces above the pretension at the fitted levels, of the fitted repeats' mean curve."""
        strains = np.array(LEVELS) * self.fitted
        return np.mean([self.repeats[i].force_at(strains) for i in FITTED], axis=0)


def read(knit, along, share=SHARE, folder=DATA):
    """A pull of a folder that holds <knit>_<along>.npz and .json, reduced or as the source has them."""
    path = folder / f"{knit}_{along}.npz"
    told = json.loads(path.with_suffix(".json").read_text(encoding="utf-8"))
    force, pins = reduced(path)
    found = [_repeat(*parts) for parts in zip(force.astype(float), pins.astype(float), strict=True)]
    repeats = tuple(repeat for repeat, _, _ in found)
    slack, clamps = (float(np.mean([found[i][k] for i in FITTED])) for k in (1, 2))
    end = max(r.strain[-1] for r in repeats)
    return Pull(
        f"{knit}_{along}",
        along,
        repeats,
        fitted=slack + share * (end - slack),
        end=end,
        length=clamps,
        width=max(told["fabric_width_px"] / told["clamp_px"], *(repeats[i].width for i in FITTED)),
    )


def _repeat(force, pins):
    """A repeat, its strain at the start (slack, below zero), and the clamps' distance under the pretension."""
    seen = ~np.isnan(force)
    force, pins = force[seen], pins[seen]
    between = [np.linalg.norm(pins[:, a] - pins[:, b], axis=1) for a, b in ((TOP, BOTTOM), (RIGHT, LEFT))]
    # The gauge rises and falls as the knit is pulled and relaxes. Points of equal force become one, so that both ways
    # are functions.
    rising, block = np.unique(isotonic_regression(force).x, return_inverse=True)
    count = np.bincount(block)
    extension, width = (np.bincount(block, d) / count for d in between)
    clamps = np.bincount(block, np.linalg.norm(pins[:, HIGH_CLAMP] - pins[:, LOW_CLAMP], axis=1)) / count
    length, side, clamp = (float(np.interp(PRETENSION, rising, d)) for d in (extension, width, clamps))
    on = rising > PRETENSION
    points = [np.concatenate([[0.0], a[on]]) for a in (extension / length - 1, rising - PRETENSION, 1 - width / side)]
    return Repeat(*points, length, side), extension[0] / length - 1, clamp


class Sheet:
    """A pull's sheet under a force: clamps that move without turning at both ends, and its middle held."""

    def __init__(self, pull, force, law, cells=CELLS, stretch=1.0):
        x = pull.along == "x"
        size = (pull.length, pull.width)
        count = [2 * max(2, round(side / np.sqrt(4 * pull.length * pull.width / cells))) for side in size]
        self.mesh = grid(*(size if x else size[::-1]), *(count if x else count[::-1]))
        self.middle = self.mesh.vertices.mean(axis=0)
        self.pull, self.direction = pull, np.array([1.0, 0.0, 0.0] if x else [0.0, 1.0, 0.0])
        self.scene = sb.Scene(pull.name, gravity=(0.0, 0.0, 0.0))
        ends = [self.mesh.sets[name] for name in (("left", "right") if x else ("bottom", "top"))]
        along = (self.mesh.vertices - self.middle) @ self.direction
        start = self.mesh.vertices + (stretch - 1) * along[:, None] * self.direction
        self.cloth = sb.add_cloth(
            self.scene,
            self.mesh,
            "knit",
            density=1.0,
            warp=10.0,
            weft=10.0,
            shear=4.0,
            poisson=0.3,
            law=law,
            bending=FLAT,
            bending_model="dihedral",
            held=np.concatenate(ends),
            positions=start,
        )
        held = int(np.linalg.norm(self.mesh.vertices - self.middle, axis=1).argmin())
        self.scene.pin([self.cloth.particles[held]])
        for sign, end, name in zip((-1.0, 1.0), ends, ("low", "high"), strict=True):
            clamp = self.scene.add_particles(start[end].mean(axis=0)[None], 1.0)
            pairs = np.column_stack([self.cloth.particles[end], np.repeat(clamp, len(end))])
            offsets = start[end] - start[end].mean(axis=0)
            self.scene.add_constraints("attachment", pairs, name=f"clamp_{name}", rest=offsets)
            self.scene.add_force(clamp, (sign * force * self.direction)[None, None])

    def pins(self, lengths, widths):
        """Places of the upper and of the right pins that stand so far from those opposite at rest."""
        across = np.array([1.0, 1.0, 0.0]) - self.direction
        points = [self.middle + d / 2 * self.direction for d in lengths]
        points += [self.middle + d / 2 * across for d in widths]
        return sb.on_cloth(self.cloth, np.array(points)[:, :2])


def experiments(pull, law, cells=CELLS, weights=EVEN):
    """Two equilibria per level: one compared along the pull, one across it; a marker per fitted repeat."""
    found = []
    repeats = [pull.repeats[i] for i in FITTED]
    loads = pull.loads()
    for load in loads:
        loose = ((PRETENSION + loads[-1]) / (PRETENSION + load)) ** weights.emphasis
        strains = np.array([r.strain_at(load) for r in repeats])
        narrowing = np.array([r.narrowing_at(s) for r, s in zip(repeats, strains, strict=True)])
        lengths, widths = np.array([r.length for r in repeats]), np.array([r.width for r in repeats])
        for part, rest, values, factor in (
            ("length", lengths, lengths * (1 + strains), loose),
            ("width", widths, widths * (1 - narrowing), loose * weights.sides),
        ):
            sheet = Sheet(pull, load, law, cells, 1 + float(strains.mean()))
            axis = pull.along if part == "length" else "xy".replace(pull.along, "")
            positions = np.tile(sheet.middle, (len(rest), 1))
            positions[:, "xy".index(axis)] += values / 2
            places = sheet.pins(rest, []) if part == "length" else sheet.pins([], rest)
            name = f"{pull.name}_{part}_{load:.2f}N"
            recording = sb.Recording(positions=positions[None], times=np.zeros(1), name=name)
            sigma = float(factor) * SPREAD * pull.fitted * float(rest.mean()) / 2
            found.append(
                sb.Experiment(
                    scene=sheet.scene, recording=recording, markers=places, static=True, sigma=sigma, axes=axis
                )
            )
    return found
