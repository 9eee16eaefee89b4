"""Strains of triangles, and the pictures of them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import sheetbend as sb
from sheetbend.pictures.field_plot import Field, plot_fields
from sheetbend.pictures.plotting import save
from sheetbend.pictures.strain import green_strain, strain_fields

MESH = sb.mesh.grid(0.2, 0.1, 4, 2)


def stretched(F: np.ndarray) -> np.ndarray:
    return MESH.vertices[:, :2] @ F.T


def test_strain_is_that_of_the_deformation_in_material_axes() -> None:
    F = np.array([[1.1, 0.2], [0.0, 0.9], [0.0, 0.3]])
    E = (F.T @ F - np.eye(2)) / 2
    np.testing.assert_allclose(
        green_strain(MESH, stretched(F)), np.tile([E[0, 0], E[1, 1], 2 * E[0, 1]], (16, 1)), atol=1e-13
    )
    angle = 0.3
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    turned = sb.TriangleMesh(MESH.vertices, MESH.triangles, MESH.material @ turn, MESH.sets)
    other = turn.T @ E @ turn
    np.testing.assert_allclose(
        green_strain(turned, stretched(F))[0], [other[0, 0], other[1, 1], 2 * other[0, 1]], atol=1e-13
    )


def test_energy_per_area_is_that_of_the_law_and_missing_where_all_corners_are_held() -> None:
    scene = sb.Scene("sheet")
    held = MESH.within([-1, -1, -1], [0.06, 1, 1])
    cloth = sb.add_cloth(scene, MESH, density=0.1, warp=50.0, weft=30.0, shear=8.0, held=held)
    scene.pin(cloth.particles[held])
    x = stretched(np.array([[1.1, 0.2], [0.0, 0.9], [0.0, 0.3]]))
    fields = strain_fields(scene, cloth, x)
    u, v, shear = (fields[f"strain_{name}"] for name in ("warp", "weft", "shear"))
    rigid = np.isin(MESH.triangles, held).all(axis=1)
    assert rigid.any() and (np.isnan(fields["membrane_energy"]) == rigid).all()
    expected = (50.0 * u**2 + 30.0 * v**2 + 8.0 * shear**2) / 2
    np.testing.assert_allclose(fields["membrane_energy"][~rigid], expected[~rigid], rtol=1e-12)


def test_a_picture_of_each_kind(tmp_path: Path) -> None:
    places = MESH.at([[0.1, 0.05], [0.15, 0.02]])
    values = np.linspace(-1.0, 1.0, 16)
    values[3] = np.nan
    measured = np.array([[0.1, 0.05, 0.0], [np.nan] * 3])
    fields = [
        Field("a [1]", values, MESH.vertices, measured=measured),
        Field("b [1]", values**2),
        Field("c [mm]", np.array([0.1, np.nan]), places=places),
    ]
    panels = plot_fields(MESH, fields, title="three")
    labels = [axis.get_xlabel() for axis in panels[0].figure.axes]
    assert {"a [1]", "b [1]", "c [mm]", "along the warp [m]"} <= set(labels)
    save(panels, tmp_path / "three.png")
    assert (tmp_path / "three.png").stat().st_size > 10_000


def test_colors_go_around_zero_only_where_both_signs_occur() -> None:
    for values, ends in (
        (np.linspace(-1, 2, 16), (-2, 2)),
        (np.linspace(0, 2, 16), (0, 2)),
        (-np.ones(16), (-1, 0)),
        (np.zeros(16), (0, 1)),
    ):
        (drawn,) = plot_fields(MESH, [Field("a", values)])[0].collections
        assert drawn.get_clim() == pytest.approx(ends)


@pytest.mark.parametrize(
    ("gravity", "axis", "turned"), [((0, -9.81, 0), 1, False), ((0, 9.81, 0), 1, True), ((0, 0, 0), 2, False)]
)
def test_what_gravity_pulls_at_hangs_down(gravity: tuple, axis: int, turned: bool) -> None:
    (panel,) = plot_fields(MESH, [Field("a", np.ones(16), MESH.vertices)], gravity=gravity)
    assert panel._vertical_axis == axis
    low, high = (panel.get_xlim(), panel.get_ylim(), panel.get_zlim())[axis]
    assert (low > high) == turned


@pytest.mark.parametrize(("fields", "problem"), [([], "at least one"), ([Field("a", np.ones(3))], "shape")])
def test_what_is_refused(fields: list[Field], problem: str) -> None:
    with pytest.raises(sb.InputError, match=problem):
        plot_fields(MESH, fields)


def test_fields_of_one_scale_have_the_same_colors_and_one_bar() -> None:
    alone, values = np.linspace(0.0, 1.0, 16), np.linspace(-2.0, 1.0, 16)
    fields = [Field("u", alone, MESH.vertices, scale="strain [%]"), Field("v", values, scale="strain [%]")]
    panels = plot_fields(MESH, [*fields, Field("other [m]", alone)])
    limits = [panel.collections[0].get_clim() for panel in panels]
    assert limits == [(-2, 2), (-2, 2), (0, 1)]
    bars = [axes.get_xlabel() for axes in panels[0].figure.axes if axes not in panels]
    assert bars == ["strain [%]", "other [m]"]
    assert [panel.get_title() for panel in panels] == ["u", "v", ""]


def test_numbers_at_places_are_drawn_in_space() -> None:
    places = MESH.at([[0.1, 0.05], [0.15, 0.02]])
    (panel,) = plot_fields(MESH, [Field("rms [mm]", np.array([1.0, 2.0]), MESH.vertices, places)])
    dots = panel.collections[1]
    np.testing.assert_allclose(np.array(dots._offsets3d)[:2].T, [[0.1, 0.05], [0.15, 0.02]], atol=1e-12)
    assert list(dots.get_array()) == [1.0, 2.0]
