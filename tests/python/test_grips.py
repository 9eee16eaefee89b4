"""Grips of rods: poses, markers, tilts and roll do what they say, and their derivatives are right."""

from __future__ import annotations

import numpy as np
import pytest
import sheetbend as sb
from pytest import approx
from scipy.spatial.transform import Rotation
from sheetbend.objects.grip import carried

TIMES = np.linspace(0.0, 0.4, 21)
TURNS = Rotation.from_rotvec(np.stack([0.8 * np.sin(5 * TIMES), 0.5 * TIMES, 1.1 * np.cos(3 * TIMES)], axis=1))
PLACES = 0.05 * np.stack([np.sin(6 * TIMES), np.cos(4 * TIMES), TIMES], axis=1)


def units(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


# --- poses


def test_poses_turn_the_grippers_axes():
    along, across = np.array([0.3, 0.5, -1.0]), np.array([1.0, 1.0, 0.2])
    grip = sb.Grip.from_poses(TIMES, PLACES, 3.0 * TURNS.as_quat(), along, across)  # of any length
    assert grip.position == approx(PLACES)
    assert grip.direction == approx(TURNS.apply(units(along)), abs=1e-14)
    unit = units(along)
    assert grip.director == approx(TURNS.apply(units(across - (across @ unit) * unit)), abs=1e-14)
    assert not grip.stays


def test_poses_of_either_sign_are_the_same():
    signs = np.where(np.arange(len(TIMES)) % 2 == 0, 1.0, -1.0)[:, None]
    plain, flipped = (sb.Grip.from_poses(TIMES, PLACES, s * TURNS.as_quat()) for s in (1.0, signs))
    assert flipped.direction == approx(plain.direction, abs=1e-15)
    assert flipped.director == approx(plain.director, abs=1e-15)


def test_a_fixed_grip_makes_its_director_unit_and_across():
    grip = sb.Grip.fixed((1, 2, 3), (0, 0, 5), (3, 0, 4))
    assert grip.stays
    assert grip.direction == approx(np.array([[0, 0, 1.0]]))
    assert grip.director == approx(np.array([[1.0, 0, 0]]))


# --- markers


def test_markers_carry_the_director_by_the_shortest_rotation():
    """Against the rotation vector: about nominal x direction, by the angle between them."""
    nominal, director = units(np.array([1.0, 0.2, -0.3])), np.array([0.0, 1.0, 1.0])
    along = TURNS.apply([1.0, 0.1, 0.0])
    first, second = PLACES, PLACES + 0.03 * along
    grip = sb.Grip.from_markers(TIMES, first, second, nominal=nominal, director=director)
    axis = np.cross(nominal, units(along))
    angle = np.arctan2(np.linalg.norm(axis, axis=1), units(along) @ nominal)
    across = units(director - (director @ nominal) * nominal)
    expected = Rotation.from_rotvec(angle[:, None] * units(axis)).apply(across)
    assert grip.director == approx(expected, abs=1e-12)
    assert grip.direction == approx(units(along), abs=1e-14)
    assert grip.position == approx(second)
    assert np.abs((grip.director * grip.direction).sum(axis=1)).max() < 1e-12


@pytest.mark.parametrize("place", [(0.5, 0.0, 0.0), (0.0, 0.0, 0.0), (0.2, 0.3, 0.0), (3.0, 0.0, 0.0)])
def test_a_rope_with_a_grip_at_its_end_alone_is_straight_and_ends_there(place):
    """Its last link was folded back on the others where the grip was nearer to `start` than the length."""
    scene = sb.Scene("rope")
    grip = sb.Grip.fixed(place, (1.0, 0.0, 0.0))
    rope = sb.add_rope(scene, length=1.0, segments=10, density=0.1, EI=1e-3, direction=(0.0, 0.6, 0.8), grip_end=grip)
    back = np.linspace(-1.0, 0.0, 11)[:, None] * np.array([0.0, 0.6, 0.8])
    assert scene.positions[rope.particles] == approx(np.array(place) + back, abs=1e-12)


def test_a_clamp_stays_where_it_is_given_beside_a_grip_at_the_end():
    """A fit of the start to the length moved the clamp."""

    def at(x, EA):
        scene, grip = sb.Scene("rope"), sb.Grip.fixed((x, 0.0, 0.0), (1.0, 0.0, 0.0))
        size = {"length": 1.0, "segments": 4, "density": 0.1, "EI": 1e-3, "EA": EA}
        rope = sb.add_rope(scene, **size, clamp_start=(1.0, 0.0, 0.0), grip_end=grip)
        return scene.positions[rope.particles]

    assert at(1.0, None)[:, 0] == approx([0.0, 0.25, 0.5, 0.75, 1.0], abs=1e-12)
    assert at(1.2, 1e3)[:, 0] == approx([0.0, 0.3, 0.6, 0.9, 1.2], abs=1e-12)
    with pytest.raises(sb.SceneError, match="cannot be bent to the length"):
        at(0.9, 1e3)


def test_points_that_meet_a_grip_in_the_wrong_place_are_refused():
    """NumPy failed in an SVD of numbers that were none."""
    grip = sb.Grip.fixed((0.5, 0.0, 0.0), (1.0, 0.0, 0.0))
    line = [(0.0, 0.0, 0.0), (0.5, 0.0, 0.0), (1.0, 0.0, 0.0)]
    with pytest.raises(sb.SceneError, match="cannot be bent to the length"):
        sb.add_rope(sb.Scene("rope"), length=1.0, segments=2, density=0.1, points=line, grip_end=grip)


def test_a_grip_at_the_end_is_where_the_rod_enters_it():
    first, second = PLACES, PLACES + 0.03 * TURNS.apply([1.0, 0, 0])
    grip = sb.Grip.from_markers(TIMES, first, second, end=True)
    assert grip.position == approx(first)
    assert grip.direction == approx(units(second - first))


def test_recordings_that_share_the_nominal_direction_agree():
    """Where two recordings have the same direction they have the same frame; by their own means they have not."""
    along = TURNS.apply([1.0, 0.1, 0.0])
    parts = (slice(0, 12), slice(8, 21))

    def frames(part: slice, **options) -> np.ndarray:
        return sb.Grip.from_markers(TIMES[part], PLACES[part], PLACES[part] + along[part], **options).director

    shared = [frames(part, nominal=(1, 0, 0), director=(0, 0, 1)) for part in parts]
    assert shared[0][8:] == approx(shared[1][:4], abs=1e-14)
    own = [frames(part, director=(0, 0, 1)) for part in parts]
    assert np.abs(own[0][8:] - own[1][:4]).max() > 1e-3


def test_carried_vectors_keep_their_length_and_angle():
    nominal, directions = np.array([0.0, 0.0, 1.0]), units(np.random.default_rng(0).standard_normal((50, 3)))
    vector = np.array([0.3, -0.4, 0.5])
    turned = carried(vector, nominal, directions)
    assert np.linalg.norm(turned, axis=1) == approx(np.linalg.norm(vector), rel=1e-12)
    assert (turned * directions).sum(axis=1) == approx(vector @ nominal, rel=1e-12)
    assert carried(vector, nominal, nominal[None])[0] == approx(vector)


# --- tilts and roll


SHEAR = pytest.mark.parametrize("shear", [{}, {"GA": 0.5}], ids=["", "shear"])


def held(**options) -> sb.Scene:
    """A stiff rod without weight between nothing but its start's grip, straight."""
    grip = sb.Grip.fixed((0, 0, 0), (1, 0, 0), (0, 1, 0))
    given = {"density": 0.05, "EI": 1e-3, "GJ": 1e-3, "start": grip, "tilts": True, "gravity": (0, 0, 0)}
    return sb.rod(0.5, 6, **(given | options))


@SHEAR
@pytest.mark.parametrize(("tilt", "towards"), [(1, (0, 1, 0)), (2, (0, 0, 1))])
def test_a_tilt_turns_the_rod_towards_its_axis(tilt, towards, shear):
    angle, scene = 0.1, held(**shear)
    rest = sb.equilibrium(scene, values={f"rod_start_tilt_{tilt}": angle})
    tip = rest.positions[scene.ropes["rod"].particles[-1]]
    assert tip == approx(0.5 * units(np.array([1.0, 0, 0]) + angle * np.array(towards)), abs=1e-9)


def test_tilts_and_roll_at_an_end_that_moves():
    """Ghost and director of a driven end, from the motion that the compiled scene gets."""
    end = sb.Grip.from_poses(TIMES, np.add(PLACES, (0.3, 0, 0)), TURNS.as_quat())
    start = sb.Grip.fixed((0, 0, 0), (1, 0, 0), (0, 0, 1))
    points = [[0, 0, 0], [0.1, 0.1, 0], PLACES[0] + (0.3, 0, 0)]
    options = {"density": 0.05, "EI": 1e-3, "GJ": 1e-3, "points": points, "tilts": True, "shifts": True, "roll": True}
    scene = sb.rod(0.5, 6, start=start, end=end, **options)
    rod = scene.ropes["rod"]
    values = {"rod_end_tilt_1": 0.2, "rod_end_tilt_2": -0.1, "rod_roll": 0.7}
    motion = sb.simulate(scene, TIMES, sb.Solver(h=0.02), values).nodes[1:]
    leave = motion[:, rod.end_ghost] - motion[:, rod.particles[-1]]
    second = np.cross(end.direction, end.director)
    expected = end.direction + 0.2 * end.director - 0.1 * second
    assert units(leave) == approx(units(expected)[1:], abs=1e-9)
    rolled = np.cos(0.7) * end.director + np.sin(0.7) * second
    assert motion[:, rod.directors[-1]] == approx(rolled[1:], abs=1e-9)
    moved = {"rod_end_shift_1": 4e-3, "rod_end_shift_2": -2e-3, "rod_end_shift_3": 3e-3}
    shifted = sb.simulate(scene, TIMES, sb.Solver(h=0.02), values | moved).nodes
    expected = end.position + 4e-3 * end.director - 2e-3 * second + 3e-3 * end.direction
    assert shifted[:, rod.particles[-1]] == approx(expected, abs=1e-12)
    assert shifted[1:, rod.end_ghost] - shifted[1:, rod.particles[-1]] == approx(leave, abs=1e-12)
    assert shifted[:, rod.particles[0]] == approx(0.0, abs=1e-15)
    off = shifted[0, rod.particles] - sb.simulate(scene, [0.0], sb.Solver(h=0.02), values).positions[0, rod.particles]
    assert off[3] == approx(0.5 * off[-1], abs=1e-12)  # of six links: the start follows along the rod


def hanging(moves: bool, **options) -> sb.Scene:
    """A rod that hangs between two grips that stay, as fixed ones or as driven ones that do not move."""
    still = np.zeros((2, 1))
    grips = [
        sb.Grip([0.0, 1.0], still + place, still + way, still + np.array([0, 1.0, 0]))
        if moves
        else sb.Grip.fixed(place, way, (0, 1, 0))
        for place, way in (((0, 0, 0), (1.0, 0, 0)), ((0.3, 0, 0), (1.0, 0, 0)))
    ]
    points = [[0, 0, 0], [0.1, 0, -0.15], [0.2, 0, -0.15], [0.3, 0, 0]]
    given = {"density": 0.05, "EI": 1e-3, "GJ": 1e-3, "points": points, "roll": True} | options
    return sb.rod(0.5, 10, start=grips[0], end=grips[1], **given)


@pytest.mark.parametrize("moves", [False, True])
@pytest.mark.parametrize("roll", [-1.3, 0.4, 2.5])
def test_a_roll_twists_every_joint_alike_at_the_start(roll, moves):
    """Against the rotation of each director about its edge."""
    scene = hanging(moves)
    rod = scene.ropes["rod"]
    plain, rolled = (sb.simulate(scene, [0.0], values={"rod_roll": r}).nodes[0] for r in (0.0, roll))
    chain = np.array([rod.start_ghost, *rod.particles, rod.end_ghost])
    tangents = units(np.diff(plain[chain], axis=0))
    shares = np.linspace(0.0, roll, len(tangents))[:, None]
    expected = Rotation.from_rotvec(shares * tangents).apply(plain[rod.directors])
    # the series' next terms, at most roll^10/10! and roll^11/11!
    assert rolled[rod.directors] == approx(expected, abs=max(1e-13, 1.1 * abs(roll) ** 10 / 3628800))


@pytest.mark.parametrize("moves", [False, True])
def test_a_roll_does_not_kick_the_rod_through_its_damping(moves):
    """What it adds to the speed is what its twist does to a rod whose bending is not damped."""

    def added(**damping: float) -> float:
        scene = hanging(moves, **damping)
        nodes = scene.ropes["rod"].particles
        unrolled, rolled = (
            sb.simulate(scene, [5e-3], sb.Solver(h=1e-3, iterations=5), {"rod_roll": roll}).velocities[0, nodes]
            for roll in (0.0, 1.2)
        )
        return float(np.abs(rolled - unrolled).max())

    assert added(bend_damping=0.05) == approx(added(), rel=0.1)


def everything(**options: float) -> sb.Scene:
    """A rod between two moving grips with all that a rod can have."""
    start = sb.Grip.from_poses(TIMES, PLACES, TURNS.as_quat())
    first = np.add(PLACES, (0.3, 0.1, 0))
    end = sb.Grip.from_markers(TIMES, first, first + TURNS.apply([0.02, 0.02, 0]), end=True)
    points = [PLACES[0], PLACES[0] + (0.1, 0.1, -0.15), PLACES[0] + (0.3, 0.1, 0)]
    return sb.rod(
        0.5,
        6,
        density=0.05,
        EI=1e-3,
        EI2=4e-4,
        GJ=6e-4,
        EA=200.0,
        points=points,
        start=start,
        end=end,
        tilts=True,
        shifts=True,
        roll=True,
        stretch_damping=1e-3,
        bend_damping=0.02,
        twist_damping=0.03,
        drag_linear=0.01,
        drag_quadratic=0.02,
        curvature_modes=(0, 1),
        twist_modes=(0, 2),
        softness_modes=(1,),
        density_modes=(1, 2),
        **options,
    )


SET = {
    "rod_start_tilt_1": 0.1,
    "rod_start_tilt_2": -0.05,
    "rod_end_tilt_1": 0.03,
    "rod_end_tilt_2": 0.08,
    "rod_start_shift_1": 0.004,
    "rod_start_shift_3": -0.003,
    "rod_end_shift_2": 0.005,
    "rod_roll": 0.6,
    "rod_curvature_1_0": 2.0,
    "rod_curvature_2_0": -1.0,
    "rod_curvature_1_1": 1.5,
    "rod_curvature_2_1": 0.7,
    "rod_twist_0": 3.0,
    "rod_twist_2": -2.0,
    "rod_softness_1": 0.3,
    "rod_density_1": -0.4,
    "rod_density_2": 0.2,
}


SHEARS = {"GA": 0.7, "shear_damping": 0.01}
YIELDS = {"yield_curvature": 3.0, "yield_share": 0.4, "slid_modes": (0, 1)}


@pytest.mark.parametrize("options", [{}, SHEARS, SHEARS | YIELDS], ids=["", "shear", "shear and yield"])
@pytest.mark.parametrize("integrator", ["bdf1", "bdf2"])
def test_gradients_of_everything(integrator, options):
    solver = sb.Solver(h=1 / 400, integrator=integrator)
    report = sb.check_gradients(everything(**options), np.arange(0, 41, 10) / 400, solver, values=SET)
    rows = {row.name: row for row in report.rows}
    # The derivative with respect to what holds a director, of which a roll is 1e7 times the torque, is good to
    # rounding times that.
    assert report.passed, str(report)
    assert rows["mass"].complex_step < 1e-6
    assert report.dot_product < 1e-11
    for name in everything(**options).quantities:
        assert rows[name].gradient > 0, name


def test_torch_has_the_same_functions_of_quantities():
    """EI2 enters by square roots, roll by sine and cosine."""
    torch = pytest.importorskip("torch")
    from sheetbend.torch import simulate

    scene, times, solver = everything(), np.array([0.0, 0.05]), sb.Solver(h=1 / 400)
    given = SET | {"rod_EI2": 5e-4}
    values = {name: torch.tensor(value, dtype=torch.float64, requires_grad=True) for name, value in given.items()}
    positions = simulate(scene, times, solver, values=values)
    rolled_out = sb.rollout(scene, times, solver, given)
    assert positions.detach().numpy() == approx(rolled_out.positions, abs=1e-12)
    positions.square().sum().backward()
    slopes = rolled_out.gradient(2 * rolled_out.positions).quantities
    for name, value in values.items():
        assert float(value.grad) == approx(slopes[name], rel=1e-8), name
