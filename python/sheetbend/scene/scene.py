"""Scenes: particles, constraint groups, boundary motion and forces, built step by step and then frozen."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from ..arrays.checks import check_kind, check_label, node_array, per_item
from ..arrays.types import Array
from ..errors import SceneError
from ..mesh.triangle_mesh import TriangleMesh
from ..quantities.kinds import KINDS
from ..quantities.quantities import ZERO_OR_MORE, Term, product
from .blown import BlownScene
from .bodies import (
    HasPoses,
    Path,
    add_drag,
    add_nodes,
    check_name,
    checked_inertia,
    checked_start,
    drive_body,
    driven_start,
    make_body,
    named_start,
    nodes_of,
)
from .body import Body, BodyPoint
from .body_force import push_body
from .body_points import points_of
from .colliders import Collider
from .compiled import CompiledScene
from .contacts import ContactNumbers, HasParticles
from .group import make_group
from .inertia import Inertia
from .scene_checks import validate


class Scene(BlownScene):
    """A scene under construction; `freeze()` (done by the first simulation) ends the construction.

    Every number enters either as a plain value or as a named quantity (`<group>_<quantity>`), by which gradients, fits
    and reports know it. SI units, z up.
    """

    def add_body(
        self,
        name: str = "body",
        *,
        mass: float | None = None,
        inertia: ArrayLike | None = None,
        center: ArrayLike = (0.0, 0.0, 0.0),
        of: Inertia | Sequence[Inertia] | None = None,
        at: ArrayLike = (0.0, 0.0, 0.0),
        rotation: ArrayLike | None = None,
        velocity: ArrayLike = (0.0, 0.0, 0.0),
        spin: ArrayLike = (0.0, 0.0, 0.0),
        pinned: bool = False,
        poses: HasPoses | None = None,
        drag: float | None = None,
        turn_drag: float | None = None,
        keep_spin: bool = False,
    ) -> Body:
        """Add a rigid body. docs/bodies.md has the law and its limits.

        Quantities: the ten of its inertia, `<name>_mass` kg, `<name>_center_x`, `_y`, `_z` m in the body's frame,
        `<name>_inertia_1`, `_2`, `_3` kg m^2, the principal moments about the center of mass, and
        `<name>_axes_turn_x`, `_y`, `_z` rad, by which the principal axes are turned in the body's frame from where they
        were given (about its x first); of the start `<name>_x`, `_y`, `_z` m and `<name>_turn_x`, ... rad, by which the
        frame is moved from where it was given, about the world's axes, `<name>_velocity_x`, ... m/s of its origin and
        `<name>_spin_x`, ... rad/s in the world's axes; where given `<name>_drag` N s/m, `<name>_turn_drag` N m s.

        Args:
            name: of the body.
            mass: kg.
            inertia: about the center of mass, along the frame's axes: three moments or a matrix (3, 3), kg m^2.
            center: (3,) m, the center of mass in the body's frame.
            of: an `Inertia` instead of these three, such as `Inertia.of_mesh(mesh, density)`, or several that are
                welded together.
            at: (3,) m, where the origin of the body's frame starts.
            rotation: how the frame starts: a matrix (3, 3) whose columns are its axes, a quaternion (x, y, z, w) or a
                rotation vector (3,) rad; along the world's axes by default.
            velocity: (3,) m/s, of the origin of the frame.
            spin: (3,) rad/s, the angular velocity, in the world's axes.
            pinned: it stays where it is.
            poses: it rides on them, such as a `Tool`; `at`, `rotation` and the start's quantities play no part.
            drag: of the air, force on the center of mass over its speed, N s/m.
            turn_drag: torque over the angular velocity, N m s.
            keep_spin: carry the angular momentum on as a state of its own, for bodies that turn by more than 0.05 rad
                in a substep: method "direct" alone.

        Returns:
            Body, also kept as `scene.bodies[name]`.

        Raises:
            SceneError: shapes, NaN, or an inertia that no body has.
        """
        self._building()
        check_name(self, name, pinned, poses)
        given = checked_inertia(name, mass, inertia, center, of)
        path = None if poses is None else Path.of(name, poses)
        start = checked_start(name, at, rotation, velocity, spin) if path is None else path.start()
        role = "pinned" if pinned else "free" if path is None else "driven"
        x, v = nodes_of(given, start)
        nodes = add_nodes(self, x, v if role == "free" else np.zeros_like(v))
        correction = getattr(poses, "frame", None)
        state = driven_start(self, start, correction) if path else named_start(self, name, start, role)
        body = make_body(self, name, given, nodes, state, role)
        if path is not None:
            drive_body(self, body, path, correction)
        elif pinned:
            self.pin(nodes)
        else:
            self.add_constraints("rigid", [nodes[1:].tolist()], name=f"{name}_rigid")
            add_drag(self, body, drag, turn_drag)
            if keep_spin:
                body.spin_node = int(self.add_hidden(np.zeros((1, 3)), 1.0, pinned=True)[0])
        return body

    def add_force(
        self,
        particles: ArrayLike | BodyPoint,
        forces: ArrayLike,
        times: ArrayLike = (0.0,),
        name: str | None = None,
    ) -> None:
        """Let forces act on particles, or on a point of a body, linear between knots and constant outside.

        Args:
            particles: (k,), or what `Body.point` returns.
            forces: (knots, k, 3) N in the world's axes; on a point (knots, 3).
            times: (knots,) s; other forces may have others.
            name: of a force on a point, which makes it the quantities `<name>_x`, `_y`, `_z` N, and with several knots
                (at most 50) `<name>_x_0`, `_y_0`, ...; without one its numbers are none.

        Raises:
            SceneError: shapes, or NaN.
        """
        self._building()
        if isinstance(particles, BodyPoint):
            push_body(self, self.forces, particles, forces, times, name)
        elif name is not None:
            raise SceneError("add_force.name", "names a force on particles", name, "leave it out")
        else:
            self.forces.add(self.node_array("add_force.particles", particles), forces, times)

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
            particles: (count, arity) particles; of some kinds also hidden nodes, as `add_directors` returns them.
            name: of the group; the kind by default.
            compliance: one number or (count,), in the kind's unit; 0 = rigid. KINDS has the formula, such as
                "Voronoi length / EI".
            damping: one number or (count,), beta of the Rayleigh dissipation (Macklin et al. 2016, eq. 26): force per
                rate of C.
            viscosity: one number or (count,), in the unit of damping: the element resists the rate of C only. Excludes
                compliance and damping.
            rest: (count, parameters) those of KINDS whose source is "given", "measured" or "usual", in that order; also
                (count,) or one number where there is one, such as a rest length. Left out, a measured parameter is what
                the initial positions make it, and a usual one has its usual value.
            normal: unit plane normal, (3,) or (count, 3), of kinds with parameters whose source is "normal".

        Raises:
            SceneError: unknown kind, wrong shapes, values that are missing or out of range, constraints that nothing
                can move.
        """
        self._building()
        if not isinstance(kind, str) or kind not in KINDS:
            raise SceneError("kind", "is not a known constraint", kind, f"use one of: {', '.join(KINDS)}")
        name = kind if name is None else name
        check_label("add_constraints.name", name)
        if any(g.name == name for g in self.groups):
            raise SceneError("name", "is taken by another group", name, "give each group a name of its own")
        group = make_group(
            name,
            kind,
            particles,
            self.nodes,
            self.hidden_count,
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
        check_label("add_point_mass.name", name)
        (index,) = node_array("add_point_mass.particle", [particle], self.particle_count).tolist()
        self.add_quantity(f"{name}_mass", mass, "kg")
        self.add_terms([product("mass", index, 1.0, {f"{name}_mass": "identity"})])

    def set_drag(self, linear: ArrayLike | None = None, quadratic: ArrayLike | None = None) -> None:
        """Air drag per particle: linear (n,) N s/m and quadratic (n,) N s^2/m^2, force -(c1 + c2 |v|) v, where v is the
        velocity relative to the scene's wind (`set_wind`)."""
        self._building()
        for field, values in (("linear", linear), ("quadratic", quadratic)):
            if values is None:
                continue
            c = per_item(f"drag.{field}", values, self.particle_count)
            if (c < 0).any():
                raise SceneError(f"drag.{field}", "must not be negative", float(c.min()), "give zero or more")
            self._drag[field] = c
            self.has_drag = True

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

    def add_contact(
        self,
        what: ArrayLike | HasParticles,
        collider: Collider,
        *,
        friction: float,
        radius: float = 0.0,
        stiffness: float | None = None,
        restitution: float | None = None,
        dissipation: float | None = None,
        name: str | None = None,
        settle: bool = False,
        points: ArrayLike | TriangleMesh | None = None,
    ) -> str:
        """Let particles (no links or triangles) touch a shape, and return the contact's name; see docs/contact.md.

        Particles are pushed out along the normal and held by Coulomb friction; links and triangles between them are
        not. Needs method "implicit" or, for particles, "gauss_seidel". Its numbers are the quantities in brackets, and
        so are those of the collider: `<collider>_x`, `_y` and `_z`, m from where it was given, and its lengths, such as
        `<collider>_radius` m.

        Args:
            what: a rope, a rod, a cloth, particles (n,), or a body.
            collider: `Plane`, `Sphere`, `Capsule`, `Cylinder`, `Box` or `DistanceField`; one object may serve several
                contacts.
            friction: Coulomb's coefficient (`<name>_friction`); 0 is smooth.
            radius: m, of a rope, or half the thickness of cloth (`<name>_contact_radius` unless zero).
            stiffness: N/m per particle (`<name>_contact_stiffness`). By default rigid: h^2 g/1000 deep under weight.
            restitution: 0 to 1 (`<name>_restitution`), the normal speed after an impact over that before; by default 0.
            dissipation: s/m (`<name>_contact_dissipation`), of a contact with a stiffness: its push is larger by this
                times the speed at which it goes in, and smaller on the way out (Hunt & Crossley 1975). Elastic by
                default.
            name: by default that of the collider.
            settle: move what starts inside to the surface, at the values that the scene is given with; a body as a
                whole, which must be joined to nothing.
            points: of a body, (n, 3) m in its frame or the vertices of a mesh: `sb.box_corners(sides)`, or with a
                `radius` the middle of a ball. They touch, edges and faces between them do not.

        Raises:
            SceneError: numbers out of range; a body without points; when it is compiled: a start inside, restitution
                of what is held and soft.
        """
        self._building()
        check_kind("contact.settle", settle, bool, "give True or False", SceneError)
        numbers = ContactNumbers(friction, radius, stiffness, restitution, dissipation)
        own = points_of(what, points, name)
        which, name = self.contacts.check(own or what, collider, self.particle_count, numbers, name)
        carried = self.add_hidden(np.zeros((len(which), 3)), 1.0, pinned=True)
        self.contacts.add(self, collider, which, carried, numbers, name, own)
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

    def shallow(self) -> Scene:
        """A copy that shares all that it holds and is compiled anew: replace a part of it to have another scene."""
        made = copy.copy(self)
        made.__dict__.pop("compiled", None)
        return made

    def starting(self, places: Array, velocities: Array) -> Scene:
        """A copy whose nodes (nodes, 3) start that much elsewhere, m, and faster, m/s."""
        made, n = self.shallow(), self.particle_count
        made._particles = self._particles.moved(places[:n], velocities[:n])
        made._hidden = self._hidden.moved(places[n:][::-1], velocities[n:][::-1])
        return made

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
