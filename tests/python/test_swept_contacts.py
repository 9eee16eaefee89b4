"""Contacts with the method "gauss_seidel": after each sweep, particles are projected out of colliders."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import sheetbend as sb
from sheetbend.mesh import grid

SLOPE = np.pi / 6


def block(friction: float, slope: float = 0.0, speed: float = 0.0) -> sb.Scene:
    """A particle on a plane that falls toward +x, at rest or thrown along it."""
    scene = sb.Scene("block", gravity=(9.81 * np.sin(slope), 0.0, -9.81 * np.cos(slope)))
    scene.add_contact(scene.add_particles([[0, 0, 0]], 0.3, [[speed, 0, 0]]), sb.Plane(name="table"), friction=friction)
    return scene


def swept(h: float, sweeps: int, **options: str) -> sb.Solver:
    return sb.Solver(h=h, method="gauss_seidel", iterations=sweeps, **options)


def test_a_block_slides_where_coulomb_says_and_does_not_creep():
    times, solver = [0.0, 0.5], swept(1e-3, 2)
    held = sb.simulate(block(0.578, SLOPE), times, solver).positions[-1, 0]
    slid = sb.simulate(block(0.577, SLOPE), times, solver).positions[-1, 0]
    assert abs(held[0]) < 1e-8 < slid[0]
    thrown = sb.simulate(block(0.3, speed=2.0), [0.0, 0.8], swept(1e-2, 1, integrator="bdf1"))
    assert thrown.positions[-1, 0, 0] == pytest.approx(0.669585, abs=1e-6)  # closed form of the substeps


def falling_cloth(**options: float) -> sb.Scene:
    """A cloth that falls onto a ball, 9 x 9 particles."""
    scene = sb.Scene("fall")
    mesh = grid(0.2, 0.2, 8, 8)
    lifted = np.asarray(mesh.vertices) - [0.1, 0.1, -0.105]
    cloth = sb.add_cloth(
        scene, mesh, "cloth", positions=lifted, density=0.2, warp=40.0, shear=10.0, bending=1e-5, **options
    )
    scene.add_contact(cloth, sb.Sphere(center=(0, 0, 0), radius=0.1, name="ball"), friction=0.3, radius=0.001)
    return scene


def test_cloth_that_yields_may_touch():
    scene = falling_cloth(yield_curvature=5.0, yield_share=0.5)
    motion = sb.simulate(scene, [0.0, 0.1], swept(1e-3, 10))
    away = np.linalg.norm(motion.positions[-1], axis=1)
    assert away.min() > 0.101 - 1e-5
    assert motion.contacts["ball"].deepest < 1e-5
    assert np.ptp(motion.positions[-1, :, 2]) > 0.03  # the corners hang down


def test_gradients_of_cloth_on_a_ball_hold_against_independent_ones():
    report = sb.check_gradients(falling_cloth(), 0.03, swept(1e-3, 6))
    assert report.passed, str(report)


BITS = """
import hashlib, sys
sys.path.insert(0, sys.argv[1])
import numpy as np
import sheetbend as sb
from test_swept_contacts import falling_cloth, swept

rollout = sb.rollout(falling_cloth(), [0.0, 0.03], swept(1e-3, 6))
gradient = rollout.gradient(np.ones_like(rollout.positions)).inputs
both = [rollout.positions, *(gradient[name] for name in sorted(gradient))]
print(hashlib.sha256(b"".join(np.ascontiguousarray(a).tobytes() for a in both)).hexdigest())
"""


def test_motion_and_gradient_have_the_same_bits_with_every_instruction_set():
    """Packs of contacts go through registers of two, four or eight numbers."""
    found = {}
    for isa in ("portable", "x86-64-v3", "x86-64-v4"):
        command = [sys.executable, "-c", BITS, str(Path(__file__).parent)]
        run = subprocess.run(command, env=os.environ | {"SHEETBEND_ISA": isa}, capture_output=True, text=True)
        if run.returncode and "has no kernels" in run.stderr:
            continue
        assert run.returncode == 0, run.stderr
        found[isa] = run.stdout
    if len(found) < 2:
        pytest.skip(f"this machine or build has one instruction set: {', '.join(found)}")
    assert len(set(found.values())) == 1, found


def test_bodies_and_pairs_are_sent_to_implicit():
    scene = sb.Scene("box")
    body = scene.add_body(mass=0.1, inertia=(1e-4,) * 3, at=(0, 0, 0.1), name="box")
    scene.add_contact(body, sb.Plane(name="table"), friction=0.3, points=[(0, 0, -0.05)])
    with pytest.raises(ValueError, match=r"contacts of bodies.*table.*use implicit"):
        sb.simulate(scene, 0.01, swept(1e-3, 2))
    rope = sb.rope(0.5, 20, density=0.05, EA=100.0, start=(0, 0, 0))
    rope.add_self_contact(rope.ropes["rope"], radius=0.004)
    with pytest.raises(ValueError, match=r"touch each other.*use implicit"):
        sb.simulate(rope, 0.01, swept(1e-3, 2))
