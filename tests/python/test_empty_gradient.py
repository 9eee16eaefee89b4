"""A gradient that is empty says so, and why; one that is not passes."""

from __future__ import annotations

import numpy as np
import pytest
import sheetbend as sb

H, SCALE = 0.002, {"hand": 0.1}  # s, m
PASSING = 0.64  # s, in which a sideways wave passes a hanging rope of 1 m: 2 sqrt(L/g)


def hanging(begins: float = 0.0) -> sb.Scene:
    """A hanging rope without bending stiffness; `hand` is how far its upper end moves sideways, from a time on."""
    scene = sb.Scene("hanging")
    rope = sb.add_rope(scene, segments=30, points=[[0, 0, 0], [0, 0, -1]], density=0.05)
    times = np.array([0.0, begins + 0.01, begins + 0.02, begins + 0.03, begins + 1.0])
    scene.drive(rope.particles[:1], times, np.zeros((5, 1, 3)), "linear")
    scene.add_quantity("hand", 0.0, "m", positive=False, scale=0.1)
    scene.add_motion_term(0, np.outer([0.0, 0.0, 0.1, 0.2, 1.0], [1.0, 0.0, 0.0]), {"hand": "identity"})
    return scene


def tip_at(time: float, aside: float = 1.0, begins: float = 0.0) -> sb.Gradient:
    """Of the tip's squared distance from a point aside of it."""
    rolled = sb.rollout(hanging(begins), [time], sb.Solver(h=H))
    bar = np.zeros_like(rolled.positions)
    bar[0, -1] = 2.0 * (rolled.positions[0, -1] - [aside, 0.0, -0.9]) if aside else 0.0
    return rolled.gradient(bar)


def refused(gradient: sb.Gradient) -> sb.EmptyGradientError:
    with pytest.raises(sb.EmptyGradientError) as caught:
        gradient.require(SCALE)
    return caught.value


def test_what_has_not_arrived_is_refused():
    error = refused(tip_at(0.1))
    assert 0.0 < error.change < 1e-3 * error.rounding
    assert error.names == ("hand",)
    assert "empty: moving hand" in str(error) and "not arrived" in str(error)


def test_what_is_refused_moves_nothing():
    """By its scale, to the last bit of what the loss looks at."""
    tips = [sb.simulate(hanging(), [0.1], sb.Solver(h=H), {"hand": x}).positions[0, -1, 0] for x in (0.0, 0.1)]
    assert abs(tips[1] - tips[0]) < np.finfo(float).eps


def test_what_has_arrived_passes():
    gradient = tip_at(PASSING)
    gradient.require(SCALE)
    assert abs(gradient.quantities["hand"]) > 1e-2


def test_one_that_is_felt_is_enough():
    """The tip hangs by the rope's length."""
    gradient = tip_at(0.1)
    refused(gradient)
    gradient.require(SCALE | {"rope_length": 0.1})
    assert abs(gradient.quantities["rope_length"]) > 0.1


def test_motion_after_the_last_frame_is_refused():
    error = refused(tip_at(0.5, begins=0.6))
    assert error.change == 0.0 < error.rounding


def test_a_loss_that_looks_nowhere_is_refused():
    error = refused(tip_at(PASSING, aside=0.0))
    assert error.rounding == 0.0
    assert "no derivative with respect to any position" in str(error)


def test_many_names_are_shortened():
    error = sb.EmptyGradientError(tuple("abcde"), 0.0, 1e-16)
    assert "a, b, c and 2 more" in str(error)


def test_unknown_names_are_refused():
    with pytest.raises(sb.InputError, match=r"scales: name no quantity.*got 'foot'.*hand"):
        tip_at(0.1).require({"foot": 0.1})


def test_a_check_does_not_judge_what_is_not_felt() -> None:
    """A sheet that falls from rest stretches nowhere, so its gradients with respect to stiffness are rounding, not
    errors."""
    scene = sb.Scene("falling")
    sheet = sb.mesh.grid(0.3, 0.2, 3, 2, pattern="one_way")
    sb.add_cloth(scene, sheet, density=0.2, warp=200, shear=20, bending=1e-4, drag_linear=0.3)
    report = sb.check_gradients(scene, [k / 60 for k in range(4)], sb.Solver(h=1 / 240, method="newton"))
    rows = {row.name: row for row in report.rows}
    assert report.passed, report
    assert rows["cloth_warp"].unfelt and rows["cloth_bending"].unfelt
    assert not rows["cloth_drag_linear"].unfelt and not rows["velocity"].unfelt
    assert "nothing felt beyond rounding" in str(report) and report.to_dict()["gradients"]["cloth_warp"]["unfelt"]
