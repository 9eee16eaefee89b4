"""Scenes: particles, constraint groups, boundary motion and forces, built step by step and then frozen."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from ..arrays.checks import finite, indices, per_item, points
from ..errors import SceneError
from ..quantities.kinds import KINDS
from ..quantities.quantities import ZERO_OR_MORE, Term, product
from .colliders import Collider
from .compiled import CompiledScene
from .contacts import ContactNumbers, HasParticles
from .frames import Frame, directors_of, normals_of
from .group import make_group
from .moving_clamp import clamped_ends, keep_direction, let_go
from .scene_checks import validate
from .scene_data import SceneData

Array = np.ndarray


class Scene(SceneData):
    """A scene under construction; `freeze()` (done by the first simulation) ends the construction.

    Every number enters either as a plain value or as a named quantity (`<group>_<quantity>`), by which gradients, fits
    and reports know it. SI units, z up.
    """

    def add_particles(self, positions: ArrayLike, mass: ArrayLike, velocity: ArrayLike | None = None) -> Array:
        """Add particles and return their indices.

        Args:
            positions: (n, 3) m.
            mass: one for all or (n,), kg; zero where only named quantities make up the mass.
            velocity: (n, 3) m/s, at rest by default.

        Raises:
            SceneError: shapes, NaN, or negative masses.
        """
        self._building()
        x = points("positions", positions)
        m = per_item("mass", mass, len(x))
        if (m < 0).any():
            raise SceneError(
                "mass", "must not be negative", float(m.min()), "give kg; pin a particle to make it immovable"
            )
        v = np.zeros_like(x) if velocity is None else finite("velocity", velocity, x.shape, SceneError)
        first = self.particle_count
        self._positions.extend(x)
        self._velocities.extend(v)
        self._mass.extend(m)
        return np.arange(first, first + len(x))

    def add_directors(self, edges: ArrayLike, directions: ArrayLike, normals: ArrayLike | None = None) -> Array:
        """Give edges material frames and return the indices of their directors, which count as particles.

        A director is a vector across its edge, the frame's first axis; it turns about the edge without inertia.

        Args:
            edges: (n, 2) particles that each edge leads from and to.
            directions: (n, 3) initial directions, of any length and not along their edges.
            normals: (n,) of `add_normals`, for sections that shear: the directors stay across them.

        Raises:
            SceneError: shapes, NaN, or a direction along its edge.
        """
        self._building()
        return self._with_frames(*directors_of(edges, directions, normals, self.positions, self.directors))

    def add_normals(self, edges: ArrayLike) -> Array:
        """Give edges (n, 2) sections that may lean against them, and return the indices of the sections' normals, which
        count as particles. They start along the edges, and turn without inertia.

        Raises:
            SceneError: unknown particles, or an edge without length.
        """
        self._building()
        return self._with_frames(*normals_of(edges, self.positions))

    def _with_frames(self, directions: Array, frames: list[Frame]) -> Array:
        nodes = self.add_particles(directions, 0.0)
        self.directors |= dict(zip(nodes.tolist(), frames, strict=True))
        return nodes

    def pin(self, particles: ArrayLike) -> None:
        """Hold particles where they start."""
        self._building()
        self.pinned |= set(indices("pin", particles, self.particle_count))

    def drive(self, particles: ArrayLike, times: ArrayLike, positions: ArrayLike, interpolation: str = "cubic") -> None:
        """Give particles a motion. An end of a rope that is clamped takes its clamp along, which keeps its direction.

        Args:
            particles: (k,) indices.
            times: (knots,) s, increasing; one set of knots serves the whole scene.
            positions: (knots, k, 3) m.
            interpolation: "cubic" (C1) or "linear" (kicks at every knot).

        Raises:
            SceneError: shapes, NaN, times that do not increase, or other knots than an earlier call's.
        """
        self._building()
        which, ends = self._with_clamps("drive", particles)
        x = np.asarray(positions)
        if ends and x.ndim == 3 and x.shape[1] == len(which):
            x = np.concatenate([x, x[:, [slot for slot, _ in ends]]], axis=1)
            which = [*which, *(ghost for _, ghost in ends)]
        self.boundary.drive(which, times, x, interpolation, self.particle_count)
        keep_direction(self, which, ends)

    def follow(
        self,
        particles: ArrayLike,
        times: ArrayLike,
        motion: ArrayLike,
        markers: Sequence[str],
        weights: ArrayLike | None = None,
        placed: ArrayLike | None = None,
        interpolation: str = "cubic",
    ) -> None:
        """Give particles the motion of recorded markers, so that a fit can allow for its noise
        (`Experiment.driven_sigma`). Clamped ends of ropes take their clamp along, as in `drive`.

        Args:
            particles: (k,) indices.
            times: (knots,) s, increasing, from the scene's start on; see `drive`.
            motion: (knots, markers, 3) m, of the markers.
            markers: their names in the recording.
            weights: (k, markers), by which a particle moves with each; one marker for each particle by default.
            placed: (k, 3) m, where the particles are at the first knot: they move from there by what the markers move.
                By default they are where the weighted markers are.
            interpolation: "cubic" (C1) or "linear" (kicks at every knot).

        Raises:
            SceneError: shapes, NaN, times that do not increase or differ from an earlier call's, names that are
                repeated, particles that are driven already.
        """
        self._building()
        which, ends = self._with_clamps("follow", particles)
        if ends:
            slots = [slot for slot, _ in ends]
            w = np.eye(len(which)) if weights is None else np.asarray(weights, dtype=float)
            weights = np.concatenate([w, w[slots]])
            if placed is not None:
                placed = np.concatenate([np.asarray(placed, dtype=float), np.asarray(placed, dtype=float)[slots]])
            which = [*which, *(ghost for _, ghost in ends)]
        self.boundary.follow(which, times, motion, markers, weights, placed, interpolation, self.particle_count)
        keep_direction(self, which, ends)

    def _with_clamps(self, field: str, particles: ArrayLike) -> tuple[list[int], list[tuple[int, int]]]:
        """Particles to be driven, and those of them that are clamped ends of ropes, which are let go."""
        which = indices(field, particles, self.particle_count)
        ends = clamped_ends(self, which)
        let_go(self, which, ends)
        return which, ends

    def add_motion_term(self, particle: ArrayLike, coefficients: ArrayLike, factors: Mapping[str, str]) -> None:
        """Add to a driven particle's motion (knots, 3) coefficients times a product of functions of quantities; to
        those of several particles (k,) with coefficients (knots, k, 3).

        Raises:
            SceneError: the particle is not driven, shapes, NaN, or unknown quantities.
        """
        self._building()
        self.boundary.add_term(particle, coefficients, factors, self.quantities)

    def add_force(self, particles: ArrayLike, forces: ArrayLike, times: ArrayLike = (0.0,)) -> None:
        """Let forces act on particles: (knots, k, 3) N at `times` (knots,), linear between and constant outside the
        knots.

        Raises:
            SceneError: shapes, NaN, or other knots than an earlier call's.
        """
        self._building()
        self.forces.add(particles, forces, times, self.particle_count)

    def add_constraints(
        self,
        kind: str,
        particles: ArrayLike,
        *,
        name: str | None = None,
        compliance: ArrayLike | None = None,
        damping: ArrayLike | None = None,
        viscosity: ArrayLike | None = None,
        rest: ArrayLike | None = None,
        normal: ArrayLike | None = None,
    ) -> str:
        """Add a group of constraints of one kind and return its name.

        A single compliance or damping becomes the quantity `<name>_compliance` or `<name>_damping`; arrays stay per
        constraint (their gradients are in the input arrays).

        Args:
            kind: a name in `sheetbend.KINDS`, which holds what follows of each kind; docs/constraints.md lists them.
            particles: (count, arity) indices.
            name: of the group; the kind by default.
            compliance: 0 = rigid, in the kind's unit; what it is made of is in KINDS, such as "Voronoi length / EI".
            damping: beta of the Rayleigh dissipation (Macklin et al. 2016, eq. 26): force per rate of C.
            viscosity: the element resists the rate of C only, in the unit of damping; excludes compliance and damping.
            rest: (count, parameters) those of KINDS whose source is "given", "measured" or "usual", in that order; also
                (count,) or one number where there is one, such as a rest length. Left out, a measured parameter is what
                the initial positions make it, and a usual one has its usual value.
            normal: unit plane normal, (3,) or (count, 3), of kinds with parameters whose source is "normal".

        Raises:
            SceneError: unknown kind, wrong shapes, values that are missing or out of range, constraints that nothing
                can move.
        """
        self._building()
        if kind not in KINDS:
            raise SceneError("kind", "is no known constraint", kind, f"use one of: {', '.join(KINDS)}")
        name = name or kind
        if any(g.name == name for g in self.groups):
            raise SceneError("name", "is taken by another group", name, "give each group a name of its own")
        group = make_group(
            name,
            kind,
            particles,
            self.positions,
            compliance=compliance,
            damping=damping,
            viscosity=viscosity,
            rest=rest,
            normal=normal,
        )
        first = sum(len(g.particles) for g in self.groups)
        self.groups.append(group)
        if compliance is not None and np.ndim(compliance) == 0 and group.compliance[0] > 0:
            self._scalar(f"{name}_compliance", "compliance", first, group.compliance, kind)
        for label, given in (("damping", damping), ("viscosity", viscosity)):
            if given is not None and np.ndim(given) == 0:
                self._scalar(f"{name}_{label}", "damping", first, group.damping, kind)
        return name

    def add_point_mass(self, particle: int, mass: float, name: str) -> None:
        """Hang a mass [kg] on a particle as the quantity `<name>_mass`."""
        (index,) = indices("add_point_mass.particle", [particle], self.particle_count)
        self.add_quantity(f"{name}_mass", mass, "kg")
        self.add_terms([product("mass", index, 1.0, {f"{name}_mass": "identity"})])

    def shift_base(self, particle: int, by: ArrayLike) -> None:
        """Move the plain part of a particle's position, (3,) m, where terms make up the rest."""
        self._building()
        self._positions.values[particle] += np.asarray(by, dtype=float)

    def set_drag(self, linear: ArrayLike | None = None, quadratic: ArrayLike | None = None) -> None:
        """Air drag per particle: linear (n,) N s/m and quadratic (n,) N s^2/m^2, force -(c1 + c2 |v|) v."""
        self._building()
        for field, values in (("linear", linear), ("quadratic", quadratic)):
            if values is None:
                continue
            c = per_item(f"drag.{field}", values, self.particle_count)
            if (c < 0).any():
                raise SceneError(f"drag.{field}", "must not be negative", float(c.min()), "give zero or more")
            self._drag[field] = c
            self.has_drag = True

    def add_air(
        self,
        triangles: ArrayLike,
        normal: ArrayLike,
        tangential: ArrayLike,
        wind: ArrayLike | None = None,
        times: ArrayLike | None = None,
        name: str = "cloth",
    ) -> None:
        """Let air act on triangles: A (k_n |u_n| u_n + k_t |u_t| u_t) on each, a third to every corner, where the wind
        relative to the triangle, u, parts into u_n along its normal and u_t across it.

        k is air density * drag coefficient / 2 (air: 1.2 kg/m^3). One value for all is the quantity
        `<name>_air_normal` or `<name>_air_tangential`; a constant wind is the quantities `wind_x`, `wind_y`, `wind_z`.
        A changing one is multiplied by `wind_strength` and, with at most 50 knots, is `wind_x_0`, `wind_y_0`,
        `wind_z_0`, `wind_x_1` and so on.
        The force is taken at the extrapolated state, so substeps must resolve it: with BDF2 h k |u| must stay below 2/3
        of the area density. `set_drag` has no such limit, and knows no wind.

        Args:
            triangles: (count, 3) particles.
            normal, tangential: k_n, k_t, one for all or (count,), kg/m^3.
            wind: m/s, one for the whole scene: (3,), or (knots, 3) at `times`; still air, or that of an earlier call,
                by default.
            times: (knots,) s, increasing; the wind is linear between and constant outside.
            name: of the quantities.

        Raises:
            SceneError: shapes, NaN, negative coefficients, corners that are not distinct, times that do not increase,
                or another wind than an earlier call's.
        """
        self._building()
        self.air.add(self, triangles, normal, tangential, wind, times, name)

    def add_pressure(self, triangles: ArrayLike, pressure: ArrayLike, name: str = "cloth") -> None:
        """Let a pressure push triangles along their normals, (x1 - x0) x (x2 - x0): pressure * area on each, a third to
        every corner.

        One value for all is the quantity `<name>_pressure`. The force is taken at the extrapolated state, so substeps
        must resolve it: h^2 p/(area density * edge) must stay well below 1 (a balloon is calm at 0.02, not at 0.35).
        `equilibrium` takes it where it has an energy: a closed surface, or one with a held rim, under one pressure.

        Args:
            triangles: (count, 3) particles; those of a closed surface, counterclockwise from outside, are blown up.
            pressure: Pa, one for all or (count,), inside above outside.
            name: of the quantity.

        Raises:
            SceneError: shapes, NaN, or corners that are not distinct.
        """
        self._building()
        self.air.press(self, triangles, pressure, name)

    def add_volume(
        self, triangles: ArrayLike, *, compliance: float = 0.0, rest: float | None = None, name: str = "cloth"
    ) -> None:
        """Let a closed surface keep its volume V, by the energy (V - rest)^2/(2 compliance) (Macklin et al. 2016, 6.5).

        All methods but "implicit" take it, and equilibria do. The pressure that it takes, inside above outside, is in
        `Equilibrium.pressures` and `Trajectory.pressures`, in moving scenes with an error of O(h^2). Long substeps of
        "gauss_seidel" are calm, those of blocks tremble as with `add_pressure`. The numbers are the quantities
        `<name>_volume` and, unless zero, `<name>_volume_compliance`.

        Args:
            triangles: (count, 3) particles, counterclockwise as seen from outside; every edge is between two of them.
            compliance: m^3/Pa; 0 is incompressible, a gas at p Pa that keeps its temperature has V/p.
            rest: m^3, by default the volume of the particles as they were added; more blows the surface up.
            name: of the volume and its quantities.

        Raises:
            SceneError: an edge that is not between two triangles, corners that are not distinct, a surface that is
                inside out, a rest volume that is not positive, a negative compliance.
        """
        self._building()
        self.volumes.add(self, triangles, compliance, rest, name)

    def contact(
        self,
        what: ArrayLike | HasParticles,
        collider: Collider,
        *,
        friction: float,
        radius: float = 0.0,
        stiffness: float | None = None,
        restitution: float | None = None,
        name: str | None = None,
        settle: bool = False,
    ) -> str:
        """Let particles (no links or triangles) touch a shape, and return the contact's name; see docs/contact.md.

        Needs method "implicit". Quantities are in brackets; the collider's are `<collider>_x`, `_y`, `_z` and lengths.

        Args:
            what: a rope, a cloth, or particles (n,).
            collider: `Plane`, `Sphere`, `Capsule` or `Box`; one object may serve several contacts.
            friction: Coulomb's coefficient (`<name>_friction`); 0 is smooth.
            radius: m, of a rope, or half the thickness of cloth (`<name>_contact_radius` unless zero).
            stiffness: N/m per particle (`<name>_contact_stiffness`). By default rigid: h^2 g/1000 deep under weight.
            restitution: 0 to 1 (`<name>_restitution`), of particles that no constraint holds; by default 0 of all.
            name: by default that of the collider.
            settle: move what starts inside to the surface, at the values that the scene is given with.
        Raises:
            SceneError: numbers out of range; when it is compiled: a start inside, restitution of what constraints hold.
        """
        self._building()
        numbers = ContactNumbers(friction, radius, stiffness, restitution)
        which, name = self.contacts.check(what, collider, self.particle_count, numbers, name)
        carried = self.add_particles(np.zeros((len(which), 3)), 1.0)
        self.pin(carried)
        self.contacts.add(self, collider, which, carried, numbers, name)
        self.contacts.settling |= {name} if settle else set()
        return name

    def freeze(self) -> Scene:
        """End the construction: validates the whole scene and returns it. Later additions raise.

        Raises:
            SceneError: no particles, nothing that can move, free particles without mass or that nothing holds.
        """
        if not self._frozen:
            validate(self)
            self._frozen = True
        return self

    @cached_property
    def compiled(self) -> CompiledScene:
        """The frozen scene as the core sees it (freezes it)."""
        self.freeze()
        return CompiledScene(self)

    def _scalar(self, quantity: str, array: str, first: int, values: Array, kind: str) -> None:
        """Move one value shared by a whole group into a quantity."""
        unit = KINDS[kind][array]["unit"]
        value = float(values[0])
        self.add_quantity(quantity, value, unit, positive=value > 0.0, limits=None if value > 0.0 else ZERO_OR_MORE)
        self.add_terms([Term(array, first + np.arange(len(values)), 1.0, ((quantity, "identity"),))])
        values[:] = 0.0
