"""A pendulum in a recording: one to three arms on a pivot that stays, swinging in the plane of x and z."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from ..arrays.smoothing import smoothed
from ..arrays.timeseries import default_max_gap, interpolate
from ..arrays.types import Array
from ..errors import RecordingError
from ..statistics.white_noise import white_variance
from .decay import Decay, decay
from .seen import RIGID, Seen, all_around
from .swing import Moments, Swing, moments
from .take import Description, Measured, Take
from .text import joined, table

Piece = tuple[dict[str, Any], float]
"""Keys of a recording that is a part of one, and when it begins."""
SEEN_ASKEW = 0.02  # the same of three arms, which a rope is told from by how it bends
CHANCE = 6.0  # standard deviations of two estimates of the same noise, times the root of the number of frames
ASKEW = 2e-3  # of an arm, by which its length changes beyond noise, from which on the view is not square
STRETCHED = 2e-3  # by how much a picture is wider than it is high, from which on it is told
FLAT, STRAIGHT = 0.02, 0.01  # of an arm: how far it may leave its plane, and how much its length may change
BENDS = 0.6  # of l theta^2/24, by which a line gets shorter where it turns, from which on it is a rope: those 1 to 2
TURNED = 2.5  # times the noise, the standard deviation of a marker seen from an arm that it is on: 2 is expected
ONE_ANGLE = 0.02  # of the motion: by so much, at most, markers on one arm move on it; on a rope with a bob it is more
HANGS = 0.5  # of an arm: how far its end is below the pivot on average, at least, where that tells what is up
PIECES = {1: (3.0, 5.0), 2: (2.0, 2.0), 3: (1.0, 1.0)}  # s that are fitted and predicted at most, by arms: two diverge
ARMS = {1: ["arm"], 2: ["upper", "lower"], 3: ["upper", "middle", "lower"]}
KINDS = {1: "a pendulum", 2: "a double pendulum", 3: "a triple pendulum"}
FITTED, PREDICTED = 4, 4  # pieces
LEAD = 0.1  # s, at the beginning of a predicted piece, that its start is fitted to
SMOOTH = 0.1  # s, that angles are smoothed over
LEAST_LOSS = 1e-4  # N m over a power of rad/s, that a fit begins with, of an arm of 1 kg m^2
LEAST_VISCOSITY = 1e-4  # N m s/rad, that a fit begins with, where the first arm weighs 1 kg
SUBSTEP = 1 / 1600  # s, at most
LEAST_FRAMES = 20
"""Of a recording that tells what moves."""


def describe(takes: Sequence[Take], measured: Measured) -> Description | None:
    """One to three arms; None where the markers are not those of a pendulum."""
    s = takes[0].seen
    joints = _joints(s)
    if joints is None or len(takes) > 1 or not _upright(takes[0], joints):
        return None
    r = s.recording
    x = r.positions
    arms = ARMS[len(joints) - 1]
    radii = [float(np.nanmean(_distance(x, a, b))) for a, b in pairwise(joints)]
    names = [r.markers[k] for k in joints]
    notes = [
        f"{names[k + 1]} stays {radius:.6g} m from {names[k]}{', which does not move' * (k == 0)}: an arm"
        for k, radius in enumerate(radii)
    ]
    beside = [name for k, name in enumerate(r.markers) if k not in joints]
    if beside:
        notes.append(f"{joined(beside)} {'is' if len(beside) == 1 else 'are'} on the same arms, and not used")
    unknown = [
        "masses: the motion shows only their ratios. One of them is set to 1 kg (or 1 kg m^2), and the others are "
        "relative to it"
    ]
    if len(arms) > 1:
        unknown.append("how the arms that hang share a mass at their hinges: it moves like a part of either one")
    apart = max(_drift(s, a, b) for a, b in pairwise(joints))
    if apart > ASKEW:
        unknown.append(
            f"where the camera is: the arms seem to change their lengths by {100 * apart:.1g} % (1 sd). Its view is "
            "not square to their plane, or its lens is not calibrated. The angles are off by as much, which the "
            "intervals do not count where it is alike in all pieces"
        )
    stretch = _stretch(x[:, joints])
    if stretch is not None:
        unknown.append(
            f"what stretches the picture: arms seem {100 * abs(stretch):.2g} % "
            f"{'longer' if stretch > 0 else 'shorter'} where they lie along x than along z, as before a camera that "
            "looks at their plane askew, or whose pixels are not square. Angles are off by up to half of that, in rad, "
            "which the intervals do not count. Calibrate it with something of known size along both axes, or divide x "
            f"by {1.0 + stretch:.4f}"
        )
    pieces, swing = _pieces(s, takes[0], len(arms)), _swing(x, r.times, joints)
    known = decay(swing, SMOOTH) if len(arms) == 1 else _moments(s, swing, pieces, radii)
    unknown += [known.words()] if isinstance(known, Decay) else []
    # The plane is y = 0: elsewhere rounding moves the arms out of it, and the fold of their triangles grows.
    pivot = (np.nanmean(x[:, joints[0]], axis=0) * (1.0, 0.0, 1.0)).tolist()
    step = float(np.median(np.diff(r.times)))
    lines = takes[0].scene_lines + table("[solver]", {"substeps": max(1, int(np.ceil(step / SUBSTEP - 1e-9)))})
    if isinstance(known, Decay):
        lines += _point_mass(pivot, radii[0], known)
    else:
        lines += _arms(arms, pivot, radii, known)
    lines += _markers(arms, names[1:], radii)
    lines += _recordings(s, swing, pieces, arms, names[1:], radii)
    for name, entries in _parameters(arms, radii, known).items():
        lines += table(f"[parameters.{name}]", entries)
    if len(arms) > 2:
        lines += table("[fit]", {"profiles": False}, {"profiles": "true follows each number, which takes long"})
    return Description(KINDS[len(arms)], notes, unknown, lines)


def _point_mass(pivot: list[float], radius: float, lost: Decay) -> list[str]:
    """The table of a single arm."""
    torques = {key: max(value, LEAST_LOSS) * radius**2 for key, value in lost.torques.items()}
    entries = {"name": "arm", "length": radius, "mass": 1.0, "pivot": pivot} | torques
    return table("[[scene.pendulum]]", entries, {"length": "of a point mass on a massless arm that swings alike"})


def _moments(s: Seen, swing: Swing, pieces: Sequence[Piece], radii: Sequence[float]) -> Moments:
    """Those of several arms, from the pieces that are fitted."""
    shown_by = [_between(swing, piece["fit"]) for piece, _ in pieces if "held_out" not in piece]
    return moments(shown_by, np.array(radii), float(np.abs(s.gravity).max()))


def _markers(arms: Sequence[str], names: Sequence[str], radii: Sequence[float]) -> list[str]:
    """The marker of each arm, and the quantity that is its offset across."""
    lines: list[str] = []
    for arm in arms:
        lines += table(f"[scene.quantities.{arm}_zero]", {"scale": 1e-3}, {"scale": "m, of the marker's offset across"})
    for arm, name, radius in zip(arms, names, radii, strict=True):
        lines += table("[[marker]]", {"marker": name, "arm": arm, "radius": radius})
    return lines


def _recordings(
    s: Seen, swing: Swing, pieces: Sequence[Piece], arms: Sequence[str], names: Sequence[str], radii: Sequence[float]
) -> list[str]:
    """Each piece, which begins with the angles and rates that the swing has there."""
    lines: list[str] = []
    common = {"sigma": max(s.noise, 1e-4), "axes": "xz"} | ({"radius": radii[0]} if len(arms) == 1 else {})
    offsets = {name: ["", "", f"{arm}_zero"] for arm, name in zip(arms, names, strict=True)}
    for entries, start in pieces:
        frame = int(np.searchsorted(s.recording.times, start))
        values = {f"{arm}_angle": float(swing.angles[k, frame]) for k, arm in enumerate(arms)}
        values |= {f"{arm}_rate": float(swing.rates[k, frame]) for k, arm in enumerate(arms)}
        lines += table("[[recording]]", entries | common | {"offsets": offsets, "values": values})
    return lines


def _parameters(arms: Sequence[str], radii: Sequence[float], known: Decay | Moments) -> dict[str, dict[str, Any]]:
    """What is fitted."""
    found: dict[str, dict[str, Any]]
    if isinstance(known, Decay):
        found = {"arm_length": {"lower": 0.2 * radii[0], "upper": 5.0 * radii[0]}}
        found |= {f"arm_{'hinge_' * (key == 'viscosity')}{key}": {} for key in known.torques}
    else:
        found = {f"{arm}_{key}": {} for arm in arms for key in ("first_moment", "inertia")}
        del found["upper_inertia"]  # the scale of all masses
        found["upper_first_moment"]["lower"] = 1.0001 * known.inertia[0] / radii[0]  # see `add_arm`
        found |= {f"{arm}_{loss}": {} for loss in ("friction", "hinge_viscosity") for arm in arms}
        found["lower_drag"] = {}
    found |= {f"{arm}_zero": {} for arm in arms}
    return found | {f"{arm}_{key}": {"private": True} for arm in arms for key in ("angle", "rate")}


def _joints(s: Seen) -> list[int] | None:
    """The pivot and the ends of the arms, in order."""
    x, count = s.recording.positions, len(s.recording.markers)
    if count < 2 or len(s.still) != 1 or len(s.recording.times) < LEAST_FRAMES:
        return None
    order, left = [s.still[0]], set(range(count)) - set(s.still)
    while left:
        steady = [k for k in left if _change(s, order[-1], k) < (STRAIGHT if count < 4 else SEEN_ASKEW)]
        if len(steady) > 1:  # arms that swing as one, or several markers on an arm
            rigid = [k for k in steady if _rigid(s, order[-1], k)]
            steady = rigid if rigid or count != 4 else [min(steady, key=lambda k: s.apart[order[-1], k])]
        end = (
            _end_of_arm(s, order[-1], steady, left.difference(steady)) if len(steady) > 1 else min(steady, default=None)
        )
        if end is None:
            return None
        order.append(end)
        left.difference_update(steady)
    if len(order) - 1 > max(ARMS):
        return None
    if len(order) == 4 and not all(_rigid(s, a, b) for a, b in pairwise(order)) and _bends(x[:, order]):
        return None  # a rope almost keeps these distances
    return order


def _end_of_arm(s: Seen, base: int, markers: Sequence[int], others: set[int]) -> int | None:
    """The marker at the end of a rigid arm that has several: where the next arm hangs, of the last arm the outermost
    one. None where they do not turn by one angle about the base: distances along a rope hardly change where it swings a
    little."""
    x = s.recording.positions
    off = x[:, markers] - x[:, [base]]
    across, up = sorted(np.argsort(np.nanmax(np.abs(off), axis=(0, 1)))[1:])
    turned = off[..., across] + 1j * off[..., up]
    outermost = int(np.argmax(s.apart[base, markers]))
    turned = turned * np.exp(-1j * np.angle(turned[:, [outermost]]))
    moved = np.sqrt(np.nanvar(off, axis=0).sum(axis=1))
    allowed = max(TURNED * s.noise, 1e-3 * float(s.apart[base, markers[outermost]]))
    if np.nanstd(turned, axis=0).max() > allowed or allowed > ONE_ANGLE * moved.max():
        return None
    carries = {k: sum(_rigid(s, k, other) for other in others) for k in markers}
    if not others:
        return markers[outermost]
    end = max(carries, key=lambda k: carries[k])
    return end if carries[end] else None


def _change(s: Seen, a: int, b: int) -> float:
    """How much the distance of two markers changes, relative to it, beyond what noise makes."""
    return _beyond(s, a, b, 2.0 * s.noise**2)


def _drift(s: Seen, a: int, b: int) -> float:
    """How much the distance of two markers changes, relative to it, beyond what its own noise makes by chance."""
    distance = _distance(s.recording.positions, a, b)
    seen = np.isfinite(distance[:-2] + distance[1:-1] + distance[2:])
    if not seen.any():
        return 0.0
    noise = white_variance(distance, seen)
    by_chance = CHANCE / math.sqrt(np.isfinite(distance).sum())
    return _beyond(s, a, b, (1.0 + by_chance) * noise)


def _stretch(x: Array) -> float | None:
    """By how much more than along z arms (frames, joints, 3) are stretched along x, where chance does not explain it:
    the square of a length L is L^2 + 2 e dx^2 then, in first order, with the same e for all arms. Noise of dx is in
    both; how large it is, the rest tells."""
    d = np.diff(x, axis=1)
    d = d[np.isfinite(d).all(axis=(1, 2))]
    square, wide = np.square(d).sum(axis=2), np.square(d[..., 0])
    long, off, across = square.mean(axis=0), square - square.mean(axis=0), 2.0 * (wide - wide.mean(axis=0))
    size, both = float(np.square(across).sum()), float((across * off).sum())
    if not size > 0:
        return None
    rest = np.square(off - both / size * across)
    noise = rest.mean(axis=0) / (4.0 * long)  # of dx and dz
    shared = 4.0 * float((noise * wide).sum())
    found = (both - shared) / max(size - 4.0 * shared, 0.5 * size)
    sd = math.sqrt(float(rest.sum()) / max(square.size - d.shape[1] - 1, 1) / size)
    return found if abs(found) > max(STRETCHED, CHANCE * sd) else None


def _beyond(s: Seen, a: int, b: int, variance: float) -> float:
    """How much the distance of two markers changes, relative to it, beyond a variance."""
    changes = float(np.nanvar(_distance(s.recording.positions, a, b)))
    return math.sqrt(max(changes - variance, 0.0)) / float(s.apart[a, b])


def _bends(x: Array) -> bool:
    """Whether a line of markers (frames, markers, 3) gets shorter between the inner ones where it turns, as a rope
    does: by l theta^2/24 where a length l turns by theta. Between arms it turns at the hinges alone; where a camera
    looks at their plane askew, their lengths change otherwise."""
    links = np.diff(x, axis=1)
    lengths = np.linalg.norm(links, axis=2)
    ways = links / lengths[..., None]
    turns = np.arccos(np.clip((ways[:, 1:] * ways[:, :-1]).sum(axis=2), -1.0, 1.0)) ** 2
    inner = lengths[:, 1:-1]
    shorter = np.nanmean(inner, axis=0) * 0.5 * (turns[:, 1:] + turns[:, :-1]) / 24.0
    seen = np.isfinite(shorter).all(axis=1)
    shorter, inner = (a[seen] - a[seen].mean(axis=0) for a in (shorter, inner))
    share = -(shorter * inner).sum(axis=0) / np.maximum(np.square(shorter).sum(axis=0), np.finfo(float).tiny)
    return bool(np.max(share) > BENDS)


def _upright(take: Take, joints: list[int]) -> bool:
    """Whether the arms swing in a plane of two axes.

    Raises:
        RecordingError: it is not that of x and z with z up, in which arms are described.
    """
    s, r = take.seen, take.seen.recording
    off = r.positions[:, joints] - np.nanmean(r.positions[:, joints[0]], axis=0)
    wide = np.nanmax(np.abs(off), axis=(0, 1))
    normal, down = int(np.argmin(wide)), np.nanmean(off[:, 1], axis=0)
    if wide[normal] >= max(FLAT * s.apart[joints[0], joints[1]], CHANCE * s.noise):
        return False
    up = int(np.argmax(np.abs(down))) if s.up_by == "guess" else int(np.argmax(np.abs(s.gravity)))
    if normal == 1 and down[2] > HANGS * s.apart[joints[0], joints[1]]:
        fix = (
            f"turn it over, in Python: r = sb.Recording.load('{take.file}'); "
            "sb.Recording(r.positions * [1, -1, -1], r.times, r.markers).save('turned.csv')"
        )
        raise RecordingError("markers", "hang upward, if z is up, and arms are described with z up", "-z up", fix)
    if (normal, up) == (1, 2) or abs(down[up]) < HANGS * s.apart[joints[0], joints[1]]:
        return normal == 1
    axes = [3 - normal - up, normal, up]
    fix = (
        f"turn its axes, in Python: r = sb.Recording.load('{take.file}'); "
        f"sb.Recording(r.positions[:, :, {axes}], r.times, r.markers).save('turned.csv')"
    )
    problem = "swing in another plane than that of x and z with z up, in which arms are described"
    raise RecordingError("markers", problem, f"{'xyz'[axes[0]]} and {'xyz'[up]}, {'xyz'[up]} up", fix)


def _rigid(s: Seen, a: int, b: int) -> bool:
    """Whether the distance of two markers varies by no more than noise makes it."""
    spread = float(np.nanstd(_distance(s.recording.positions, a, b)))
    return spread <= max(RIGID * s.noise, 1e-3 * float(s.apart[a, b]))


def _distance(x: Array, a: int, b: int) -> Array:
    return np.asarray(np.linalg.norm(x[:, a] - x[:, b], axis=1))


def _arms(names: list[str], pivot: list[float], radii: list[float], found: Moments) -> list[str]:
    """Tables of the arms. Nothing hangs on the last one's end: any length that gives its particles a mass will do."""
    lines: list[str] = []
    for k, name in enumerate(names):
        last = k == len(names) - 1
        entries = {
            "name": name,
            "mass": found.mass[k],
            "first_moment": found.first[k],
            "inertia": found.inertia[k],
            "length": max(2.2 * radii[k], 1.5 * found.inertia[k] / found.first[k]) if last else radii[k],
            "pivot": names[k - 1] if k else pivot,
            "friction": 1e-3,
            "viscosity": max(found.viscosity[k], LEAST_VISCOSITY),
        }
        lines += table("[[scene.arm]]", entries | ({"drag": 1e-4} if last else {}))
    return lines


def _swing(x: Array, times: Array, joints: list[int]) -> Swing:
    """Angles rad from straight down towards +x, and their rates rad/s, smoothed over a moment. Curves bridge gaps."""
    places = x[:, joints]
    places[:, 0] = np.nanmean(places[:, 0], axis=0)
    near = interpolate(times, places, times, "linear", default_max_gap(times))
    reach = round(SMOOTH / 2 / float(np.median(np.diff(times))))
    known = all_around(np.isfinite(near).all(axis=(1, 2))[:, None], reach)[:, 0]
    d = np.diff(interpolate(times, places, times, "cubic", np.inf), axis=1)
    told = np.arctan2(d[:, :, 0], -d[:, :, 2]).T
    pairs = zip(told, np.isfinite(told), strict=True)
    angles = np.stack([np.interp(times, times[ok], np.unwrap(angle[ok])) for angle, ok in pairs], axis=1)
    angles, rates = smoothed(times, angles, SMOOTH)
    turns = 2.0 * np.pi * np.round(angles / (2.0 * np.pi))
    return Swing(times, (angles - turns).T, rates.T, known)


def _between(swing: Swing, part: list[float]) -> Swing:
    inside = (swing.times >= part[0]) & (swing.times <= part[1])
    return Swing(swing.times[inside], swing.angles[:, inside], swing.rates[:, inside], swing.seen[inside])


def _pieces(s: Seen, take: Take, arms: int) -> list[Piece]:
    """Recordings cut from one. Of one arm the first part is fitted, in pieces, and the rest is predicted from its first
    moments. Of more arms, fitted and predicted pieces take turns: friction is seen only where the swing has become
    small, and wide swings magnify what the model lacks."""
    t = s.recording.times
    start, stop = float(t[0]), float(t[-1])
    longest, most = PIECES[arms]
    if arms > 1:
        turn = (stop - start) / FITTED
        length, room = min(longest, turn / 2), turn / 2
        fitted = [start + k * turn for k in range(FITTED)]
        predicted = [a + turn / 2 for a in fitted]
    else:
        length = min(longest, (stop - start) / (FITTED + 2))
        fitted = [start + k * length for k in range(FITTED)]
        rest = start + FITTED * length
        room = (stop - rest) / PREDICTED
        predicted = [rest + k * room for k in range(PREDICTED)]
    found: list[Piece] = []
    for k, a in enumerate(fitted):
        found.append(({**take.reading, "name": f"fitted_{k}", "fit": [a, a + length]}, a))
    for k, a in enumerate(round(a, 4) for a in predicted):
        held = [a + LEAD + 1e-3, min(a + min(room, most), stop)]
        entries = {
            **take.reading,
            "name": f"predicted_{k}",
            "predict": "window",
            "fit": [a, a + LEAD],
        }
        found.append((entries | {"held_out": held}, a))
    return found
