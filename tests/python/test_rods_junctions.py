"""Rods that meet: rings against their closed form, a rod in two parts against one rod, branches on finer meshes."""

from itertools import pairwise

import numpy as np
import pytest
import sheetbend as sb
from pytest import approx
from support import observed_orders

EI, DENSITY, RADIUS = 1e-3, 0.05, 0.15
GRIP = sb.Grip.fixed((0, 0, 0), (1, 0, 0))


# --- closed loops


def ring(links: int, rods: int, speed: float) -> tuple[sb.Scene, dict[str, float]]:
    """A free ring of one or more rods whose rest shape it is, set going in its first mode of bending [m/s]; and its
    natural curvatures."""
    angle = 2 * np.pi / links * np.arange(links + 1)
    out, around = (np.stack([np.cos(a), np.sin(a), 0 * a], axis=1) for a in (angle, angle + np.pi / 2))
    points = RADIUS * out
    velocity = speed * (np.cos(2 * angle)[:, None] * out - 0.5 * np.sin(2 * angle)[:, None] * around)
    link = float(np.linalg.norm(points[1] - points[0]))
    scene, values = sb.Scene("ring", gravity=(0, 0, 0)), {}
    junctions, each = [sb.Junction() for _ in range(rods)], links // rods
    for k in range(rods):
        part = slice(k * each, (k + 1) * each + 1)
        sb.add_rod(
            scene,
            f"part{k}",
            length=each * link,
            segments=each,
            density=DENSITY,
            EI=EI,
            GJ=EI,
            points=points[part],
            velocity=velocity[part],
            director=(0, 0, 1) if k == 0 else None,
            start=junctions[k - 1].facing(around[part][0]),
            end=junctions[k].facing(around[part][-1]),
            curvature_modes=(0,),
        )
        values[f"part{k}_curvature_2_0"] = -2 * np.tan(np.pi / links) / link
    return scene, values


@pytest.mark.parametrize("rods", [1, 2])
def test_a_ring_vibrates_as_the_closed_form_says(rods):
    """Two waves around an inextensible ring: omega^2 = 36 EI/(5 mu R^4) (Love, Mathematical Theory of Elasticity,
    art. 293). The ring's parts and its links are nothing that it knows of."""
    omega = np.sqrt(7.2 * EI / (DENSITY * RADIUS**4))
    errors = []
    for links in (40, 80):
        scene, values = ring(links, rods, 1e-3 * omega)
        times = np.arange(round(1.1 * 2 * np.pi / omega * 1000)) / 1000
        motion = sb.simulate(scene, times, sb.Solver(h=1e-3), values).positions
        assert np.abs(motion[:, scene.ropes["part0"].particles, 2]).max() < 1e-9
        u = motion[:, scene.ropes["part0"].particles[0], 0] - RADIUS
        zero = int(np.flatnonzero(u[:-1] * u[1:] < 0)[-1])
        period = times[zero] + (times[zero + 1] - times[zero]) * u[zero] / (u[zero] - u[zero + 1])
        errors.append(abs(float(period * omega / (2 * np.pi) - 1)))
        assert u.max() == approx(1e-3, rel=0.02)
    assert errors[-1] < 1e-3
    assert errors[0] > 3.5 * errors[1]


# --- rods in series and branches


def hanging(links: int, parts: int, density: float = DENSITY, **shear: float) -> np.ndarray:
    """(3,) m: the end of a rod that hangs from a level grip, in one part or two."""
    scene, junction, options = sb.Scene("hanging"), sb.Junction(), {"density": density, "EI": EI, "GJ": EI} | shear
    if parts == 1:
        last = sb.add_rod(scene, "a", length=0.6, segments=links, start=GRIP, **options)
    else:
        sb.add_rod(scene, "a", length=0.2, segments=links // 3, start=GRIP, end=junction, **options)
        last = sb.add_rod(scene, "b", length=0.4, segments=2 * links // 3, start=junction, **options)
    return sb.equilibrium(scene).positions[last.particles[-1]]


@pytest.mark.parametrize("shear", [{}, {"GA": 0.1}], ids=["", "shear"])
def test_a_rod_in_two_parts_hangs_as_one(shear):
    apart = [float(np.linalg.norm(hanging(links, 1, **shear) - hanging(links, 2, **shear))) for links in (24, 48, 96)]
    assert apart[0] < 1e-5
    assert apart[-1] < 1e-6


def branched(finer: int, gravity: float = 9.81) -> sb.Scene:
    """A trunk with two branches that hang."""
    scene, junction, options = (
        sb.Scene("branched", gravity=(0, 0, -gravity)),
        sb.Junction(),
        {"density": DENSITY, "GJ": EI},
    )
    sb.add_rod(scene, "trunk", length=0.3, segments=8 * finer, EI=2 * EI, start=GRIP, end=junction, **options)
    for name, side in (("left", 0.3), ("right", -0.4)):
        way = np.array([0.8, side, 0.0]) / np.hypot(0.8, side)
        points = [(0.3, 0, 0), (0.3, 0, 0) + 0.25 * way]
        ends = {"points": points, "start": junction}
        sb.add_rod(scene, name, length=0.25, segments=8 * finer, EI=EI, bend_damping=0.02, **ends, **options)
    return scene


def test_branches_keep_their_angles_without_load():
    scene = branched(1, gravity=0.0)
    assert sb.equilibrium(scene).positions == approx(scene.positions, abs=1e-12)


def test_branches_converge_with_the_mesh():
    tips = []
    for finer in (1, 2, 4, 8):
        scene = branched(finer)
        x = sb.equilibrium(scene).positions
        tips.append(np.concatenate([x[scene.ropes[name].particles[-1]] for name in ("left", "right")]))
    apart = [float(np.linalg.norm(a - b)) for a, b in pairwise(tips)]
    assert apart[-1] < 1e-3
    assert observed_orders(apart) == approx(2.0, abs=0.3)


def star(branches: int) -> sb.Scene:
    """A gripped rod with several branches around its axis, each shorter than the one before, and turned."""
    scene, junction, options = sb.Scene("star"), sb.Junction(), {"density": DENSITY, "EI": EI, "GJ": EI, "segments": 6}
    sb.add_rod(scene, "trunk", length=0.3, start=GRIP, end=junction, **options)
    for k in range(branches):
        around, length = 2 * np.pi * k / branches + 0.4, 0.2 - 0.02 * k
        way = np.array([0.8, 0.6 * np.cos(around), 0.6 * np.sin(around)])
        points = [(0.3, 0, 0), (0.3, 0, 0) + length * way]
        turned = [(0, 0, 0), (0, -np.sin(around), np.cos(around))]
        sb.add_rod(scene, f"branch{k}", length=length, start=junction, points=points, velocity=turned, **options)
    return scene


@pytest.mark.parametrize(("branches", "is_banded"), [(2, True), (6, False)])
def test_gradients_pass_through_a_junction(branches, is_banded):
    """One block, which a band holds while branches are few, and else the sparse factors."""
    scene, solver = star(branches), sb.Solver(h=1 / 400)
    blocks = solver.core(scene.compiled).blocks
    assert [banded for _, _, banded in blocks] == [is_banded]
    report = sb.check_gradients(scene, [0.02], solver, samples=3)
    assert report.passed, report


# --- what is refused


def test_a_junction_belongs_to_one_scene():
    junction, options = sb.Junction(), {"length": 0.2, "density": DENSITY, "EI": EI, "GJ": EI}
    sb.add_rod(sb.Scene("one"), start=junction, **options)
    with pytest.raises(sb.SceneError, match=r"rod\.start.*another scene"):
        sb.add_rod(sb.Scene("two"), start=junction, **options)


def test_rods_that_leave_a_junction_side_by_side_are_refused():
    scene, junction, options = sb.Scene("two"), sb.Junction(), {"length": 0.2, "density": DENSITY, "EI": EI, "GJ": EI}
    sb.add_rod(scene, "one", start=junction, **options)
    with pytest.raises(sb.SceneError, match="let one of the two rods end"):
        sb.add_rod(scene, "two", start=junction, points=[(0, 0, 0), (0.2, 0.01, 0)], **options)


def test_a_way_through_a_junction_has_a_direction():
    with pytest.raises(sb.SceneError, match=r"facing.*no length"):
        sb.Junction().facing((0, 0, 0))


def test_a_ring_is_closed():
    junction = sb.Junction()
    options = {"length": 0.2, "density": DENSITY, "EI": EI, "GJ": EI, "start": junction, "end": junction}
    for points in (None, [(0, 0, 0), (0.1, 0, 0), (0.1, 0.1, 0)]):
        with pytest.raises(sb.SceneError, match=r"rod\.points.*first place"):
            sb.add_rod(sb.Scene("open"), points=points, **options)
