"""Scenes of springs that touch a shape, for this package and for others: a rope on a plane, a cloth on a sphere.

Both have particles of equal mass, springs without damping, and no air. The shape pushes a particle with the contact's
stiffness times its depth, and rubs by Coulomb's law. `loop` follows newton's law: it damps where a particle goes in,
and friction grows with the speed up to Coulomb's limit.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from pathlib import Path

import numpy as np
import sheetbend as sb

Array = np.ndarray
G = 9.81


@dataclass(frozen=True)
class Springs:
    """A scene.

    Attributes:
        start, velocity: (particles, 3) m, m/s.
        mass: of a particle, kg.
        links: (springs, 2).
        rest: (springs,) m.
        stiffness: (springs,) N/m.
        sphere: the radius around the origin, m; 0 for the plane z = 0.
        contact_stiffness: N/m per particle.
        contact_damping: newton's, N s/m per particle.
        dissipation: this package's, s/m.
        friction: Coulomb's coefficient.
        slope: newton's friction grows with the speed, by this in N s/m, up to Coulomb's limit.
        seconds: of the motion.
    """

    start: Array
    velocity: Array
    mass: float
    links: Array
    rest: Array
    stiffness: Array
    sphere: float
    contact_stiffness: float
    contact_damping: float
    dissipation: float
    friction: float
    slope: float
    seconds: float

    @property
    def seed(self) -> Array:
        """(particles, 3): the loss is the sum of this times the positions at the end."""
        s = np.arange(len(self.start)) / len(self.start)
        along = np.column_stack([np.sin(3 * s), 1 + np.cos(5 * s), np.sin(1 + 4 * s)])
        return along / len(self.start)

    @property
    def direction(self) -> Array:
        """(particles, 3): along which the start is differentiated; it keeps what touches where it is."""
        x, y, _ = self.start.T
        return np.column_stack([np.sin(1 + 7 * x + y), np.cos(1 + 9 * x - 2 * y), 0 * x])

    def export(self, path: Path) -> None:
        """Write all of it as NPZ."""
        arrays = {field.name: np.asarray(getattr(self, field.name)) for field in fields(self)}
        gravity = np.array([0.0, 0.0, -G])
        np.savez(path, seed=self.seed, direction=self.direction, gravity=gravity, **arrays)


def lengths(x: Array, links: Array) -> Array:
    return np.linalg.norm(x[links[:, 0]] - x[links[:, 1]], axis=1)


def rope_on_plane() -> Springs:
    """A wavy rope of 50 links of 2 cm that is thrown aside over a table."""
    x = np.linspace(0.0, 1.0, 51)
    mass, contact = 1e-3, 1e4
    start = np.column_stack([x, 0.02 * np.sin(4 * np.pi * x), np.full(51, -mass * G / contact)])
    velocity = np.column_stack([0 * x, 1.0 + 0.5 * np.sin(3 * np.pi * x), 0 * x])
    links = np.array([(i, i + 1) for i in range(50)] + [(i, i + 2) for i in range(49)])
    stiffness = np.repeat([5e3, 50.0], [50, 49])
    touch = {"sphere": 0.0, "contact_stiffness": contact, "contact_damping": 0.0, "dissipation": 0.0}
    rub = {"friction": 0.3, "slope": 10.0}
    return Springs(start, velocity, mass, links, lengths(start, links), stiffness, **touch, **rub, seconds=0.3)


def cloth_on_sphere(columns: int) -> Springs:
    """A cloth of 0.6 m, 0.2 kg/m^2, that lies on a sphere of 0.2 m with its middle and falls over it."""
    side = np.linspace(-0.3, 0.3, columns)
    x, y = (a.ravel() for a in np.meshgrid(side, side, indexing="ij"))
    start = np.column_stack([x, y, np.full(len(x), 0.2)])
    velocity = np.column_stack([0 * x + 0.3, 0 * x, 0 * x])
    ids = np.arange(columns**2).reshape(columns, columns)
    kinds = []
    for k, (a, b) in ((40.0, (1, 0)), (20.0, (1, 1)), (0.2, (2, 0))):
        for one, other in (
            (ids[: columns - a, : columns - b], ids[a:, b:]),
            (ids[b:, : columns - a], ids[: columns - b, a:]),
        ):
            kinds.append((np.column_stack([one.ravel(), other.ravel()]), k))
    links = np.concatenate([pairs for pairs, _ in kinds])
    stiffness = np.concatenate([np.full(len(pairs), k) for pairs, k in kinds])
    mass = 0.2 * 0.36 / columns**2
    contact = 1e5 * mass * G
    damping = 2 * (contact * mass) ** 0.5
    touch = {"sphere": 0.2, "contact_stiffness": contact, "contact_damping": damping, "dissipation": 20.0}
    rub = {"friction": 0.3, "slope": 3e3 * mass}
    return Springs(start, velocity, mass, links, lengths(start, links), stiffness, **touch, **rub, seconds=0.15)


def built(s: Springs) -> sb.Scene:
    """The scene in this package."""
    scene = sb.Scene("springs", gravity=(0.0, 0.0, -G))
    particles = scene.add_particles(s.start, s.mass, s.velocity)
    scene.add_constraints("distance", s.links, name="springs", compliance=1.0 / s.stiffness, rest=s.rest)
    ball = sb.Sphere(center=(0, 0, 0), radius=s.sphere, name="shape") if s.sphere else sb.Plane(name="shape")
    scene.add_contact(
        particles,
        ball,
        friction=s.friction,
        stiffness=s.contact_stiffness,
        dissipation=s.dissipation or None,
    )
    return scene


def changed(s: Springs, name: str, by: float) -> Springs:
    """A scene with friction or stiffness larger by a share, or with start or velocity moved along `direction`."""
    if name in ("start", "velocity"):
        return replace(s, **{name: getattr(s, name) + by * s.direction})
    return replace(s, **{name: getattr(s, name) * (1.0 + by)})


def loop(s: Springs, h: float) -> Array:
    """Positions at the end by symplectic Euler in double precision, with friction that grows with the speed."""
    x, v, rest = s.start.copy(), s.velocity.copy(), s.rest
    i, j = s.links.T
    count = len(x)
    for _ in range(round(s.seconds / h)):
        d = x[i] - x[j]
        length = np.sqrt((d * d).sum(1))
        pull = d * (s.stiffness * (1.0 - rest / length))[:, None]
        f = np.column_stack([np.bincount(j, a, count) - np.bincount(i, a, count) for a in pull.T])
        if s.sphere:
            away = np.sqrt((x * x).sum(1))
            n, gap = x / away[:, None], away - s.sphere
        else:
            n, gap = np.broadcast_to((0.0, 0.0, 1.0), x.shape), x[:, 2]
        push = s.contact_stiffness * np.maximum(0.0, -gap)
        into = (v * n).sum(1)
        slip = v - into[:, None] * n
        speed = np.sqrt((slip * slip).sum(1))
        rub = np.minimum(s.slope, s.friction * push / np.maximum(speed, 1e-12)) * (push > 0.0)
        damp = s.contact_damping * np.minimum(0.0, into) * (push > 0.0)
        f += (push - damp)[:, None] * n - rub[:, None] * slip
        v = v + h * (f / s.mass - (0.0, 0.0, G))
        x = x + h * v
    return x
