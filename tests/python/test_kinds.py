"""What Python knows of the kinds of constraints comes from their headers, and no parameter becomes zero unnoticed."""

from __future__ import annotations

import numpy as np
import pytest
import sheetbend as sb
from sheetbend import _core
from sheetbend.quantities.kinds import IN_REST
from sheetbend.scene.rest_values import rest_values

NORMAL = (0.0, 0.6, 0.8)


def stencils(kind: str, count: int = 5) -> np.ndarray:
    x = np.random.default_rng(1).normal(size=(count, sb.KINDS[kind]["arity"], 3))
    if kind.endswith("_volume"):  # of elements that are not turned inside out
        x[_core.rest_values(kind, x)[:, 0] < 0] *= -1.0
    return x


def sources(kind: str) -> set[str]:
    return {p["source"] for p in sb.KINDS[kind]["parameters"].values()}


@pytest.mark.parametrize("kind", sb.KINDS)
def test_every_parameter_is_given_measured_or_said(kind: str) -> None:
    """Also of a kind that was added yesterday: there is no list of kinds here."""
    x, parameters = stencils(kind), sb.KINDS[kind]["parameters"]
    normal = NORMAL if "normal" in sources(kind) else None
    if "given" in sources(kind):
        with pytest.raises(sb.SceneError, match="is missing"):
            rest_values("t", kind, x, None, normal)
        return
    for values, p in zip(rest_values("t", kind, x, None, normal).T, parameters.values(), strict=True):
        if p["source"] == "measured":
            assert np.ptp(values) > 0.0  # not one number for all stencils
        elif p["source"] in ("usual", "preset"):
            assert (values == p["value"]).all()


@pytest.mark.parametrize("kind", sb.KINDS)
def test_rest_has_the_columns_that_the_kind_says(kind: str) -> None:
    own = [name for name, p in sb.KINDS[kind]["parameters"].items() if p["source"] in IN_REST]
    normal = NORMAL if "normal" in sources(kind) else None
    x, given = stencils(kind), np.random.default_rng(2).uniform(0.1, 0.9, (5, len(own)))
    if own:
        values = rest_values("t", kind, x, given, normal)
        names = list(sb.KINDS[kind]["parameters"])
        assert np.array_equal(values[:, [names.index(name) for name in own]], given)
    for wrong in (np.ones((5, len(own) + 1)), np.ones((4, len(own)))):
        with pytest.raises(sb.SceneError, match=r"wrong shape|has none"):
            rest_values("t", kind, x, wrong, normal)


@pytest.mark.parametrize("kind", ["distance", "tether", "area"])
def test_lengths_and_areas_are_measured(kind: str) -> None:
    x = stencils(kind)
    wanted = np.linalg.norm(x[:, 1] - x[:, 0], axis=1)
    if kind == "area":
        wanted = np.linalg.norm(np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]), axis=1) / 2
    assert np.array_equal(rest_values("t", kind, x, None, None)[:, 0], wanted)


@pytest.mark.parametrize(
    ("kind", "rest", "problem"),
    [
        ("distance", 0.0, "rest_length of constraint 0 must be positive"),
        ("area", [1.0, 1.0, -1.0, 1.0, 1.0], "rest of constraint 2 must be positive"),
        ("friction_hinge", 0.0, "yield of constraint 0 must be positive"),
        ("yielding_curvature", np.tile([1.0, 0.1, 0.0, 0.0], (5, 1)), "share of constraint 0 must be between 0 and 1"),
    ],
    ids=["length", "area", "yield", "share"],
)
def test_values_out_of_range_are_refused(kind: str, rest: object, problem: str) -> None:
    normal = NORMAL if "normal" in sources(kind) else None
    with pytest.raises(sb.SceneError, match=problem):
        rest_values("t", kind, stencils(kind), rest, normal)


def test_a_normal_that_means_nothing_is_refused() -> None:
    with pytest.raises(sb.SceneError, match="means nothing to bend"):
        rest_values("t", "bend", stencils("bend"), None, NORMAL)


def test_units_follow_from_that_of_the_constraint() -> None:
    units = {kind: (k["unit"], k["compliance"]["unit"], k["damping"]["unit"]) for kind, k in sb.KINDS.items()}
    assert units["distance"] == ("m", "m/N", "N s/m")
    assert units["bend"] == ("", "1/(N m)", "N m s")
    assert units["hinge"] == ("rad", "rad/(N m)", "N m s/rad")
    assert units["area"] == ("m^2", "m^3/N", "N s/m^3")
    assert units["sheet_curvature"] == ("1/m", "1/(N m^3)", "N m^3 s")
