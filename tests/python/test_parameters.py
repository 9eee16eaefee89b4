"""Parameters: validation, transforms against finite differences, ties, priors and private expansion."""

from __future__ import annotations

import math

import numpy as np
import pytest
from sheetbend.errors import InputError
from sheetbend.quantities.parameters import Parameter, Parameters


def mixed() -> Parameters:
    return Parameters(
        [
            Parameter(name="rope_EA", initial=1e4, lower=1e2, upper=1e6, log=True, unit="N"),
            Parameter(name="rope_density", initial=0.05, fixed=True, unit="kg/m"),
            Parameter(name="angle", initial=0.1, lower=-1.0, upper=1.0, prior=(0.0, 0.2), unit="rad", scale=0.1),
            Parameter(name="core_EA", tied_to="rope_EA", factor=0.5, unit="N"),
            Parameter(name="skin_EA", tied_to="core_EA", factor=-4.0, unit="N"),
            Parameter(name="drag", initial=0.3, log=True, prior=(0.2, 0.5)),
        ]
    )


@pytest.mark.parametrize(
    ("fields", "blamed"),
    [
        ({"name": " "}, "parameter.name"),
        ({"initial": None}, "p.initial"),
        ({"initial": math.nan}, "p.initial"),
        ({"initial": 2.0, "upper": 1.0}, "p.initial"),
        ({"lower": 1.0, "upper": 1.0}, "p.lower"),
        ({"lower": "1 mN"}, "p.lower"),
        ({"lower": math.nan}, "p.lower"),
        ({"upper": math.nan}, "p.upper"),
        ({"initial": -1.0, "log": True}, "p.initial"),
        ({"lower": 0.0, "log": True}, "p.lower"),
        ({"prior": (1.0, 0.0)}, "p.prior"),
        ({"prior": (math.inf, 1.0)}, "p.prior"),
        ({"prior": (-1.0, 1.0), "log": True}, "p.prior"),
        ({"prior": (1.0, 1.0), "fixed": True}, "p.prior"),
        ({"factor": 2.0}, "p.factor"),
        ({"scale": 0.0}, "p.scale"),
        ({"tied_to": "q"}, "p.initial"),
        ({"tied_to": "q", "initial": None, "factor": 0.0}, "p.factor"),
        ({"tied_to": "q", "initial": None, "upper": 3.0}, "p.upper"),
        ({"tied_to": "q", "initial": None, "fixed": True}, "p.fixed"),
        ({"tied_to": "q", "initial": None, "prior": (1.0, 1.0)}, "p.prior"),
    ],
)
def test_bad_fields_are_named(fields: dict[str, object], blamed: str) -> None:
    with pytest.raises(InputError) as caught:
        Parameter(**{"name": "p", "initial": 1.0, **fields})
    assert caught.value.field == blamed
    assert caught.value.fix


def tied(name: str, target: str, private: bool = False) -> Parameter:
    return Parameter(name=name, tied_to=target, private=private)


@pytest.mark.parametrize(
    ("parameters", "words"),
    [
        ([Parameter(name="a", initial=1.0), Parameter(name="a", initial=2.0)], "twice"),
        ([Parameter(name="a", initial=1.0, fixed=True)], "nothing to fit"),
        ([], "nothing to fit"),
        ([Parameter(name="a", initial=1.0), tied("b", "c")], "not a parameter"),
        ([Parameter(name="a", initial=1.0), tied("b", "c"), tied("c", "b")], "leads back"),
        ([Parameter(name="a", initial=1.0), tied("b", "b")], "leads back"),
        ([Parameter(name="a", initial=1.0, private=True), tied("b", "a")], "one value per recording"),
    ],
)
def test_bad_sets_are_refused(parameters: list[Parameter], words: str) -> None:
    with pytest.raises(InputError, match=words):
        Parameters(parameters)


def test_internal_vector_round_trip() -> None:
    parameters = mixed()
    assert parameters.free == ("rope_EA", "angle", "drag")
    internal = np.array([math.log(2e4), -0.3, math.log(0.7)])
    values = parameters.to_physical(internal)
    assert list(values) == list(parameters)
    expected = {
        "rope_EA": 2e4,
        "rope_density": 0.05,
        "angle": -0.3,
        "core_EA": 1e4,
        "skin_EA": -4e4,
        "drag": 0.7,
    }
    assert values == pytest.approx(expected, rel=1e-14)
    np.testing.assert_allclose(parameters.to_internal(values), internal, rtol=1e-14)
    np.testing.assert_allclose(parameters.initial(), [math.log(1e4), 0.1, math.log(0.3)])


def test_logarithms_far_out_stay_positive_and_come_back() -> None:
    parameters = Parameters([Parameter(name="p", initial=1.0, log=True)])
    (value,) = parameters.to_physical(np.array([-1e4])).values()
    assert 0.0 < value < 1e-300
    assert np.isfinite(parameters.to_internal({"p": value})).all()


def test_bounds_are_transformed() -> None:
    lower, upper = mixed().bounds()
    np.testing.assert_allclose(lower, [math.log(1e2), -1.0, -math.inf])
    np.testing.assert_allclose(upper, [math.log(1e6), 1.0, math.inf])


def test_derivatives_against_central_differences() -> None:
    parameters, step = mixed(), 1e-5
    internal = np.array([9.1, 0.2, -1.3])

    def everything(at: np.ndarray) -> np.ndarray:
        return np.array(list(parameters.to_physical(at).values()))

    numeric = np.stack(
        [(everything(internal + step * e) - everything(internal - step * e)) / (2 * step) for e in np.eye(3)],
        axis=1,
    )
    np.testing.assert_allclose(parameters.chain(internal), numeric, rtol=1e-8, atol=1e-8)
    rows = [list(parameters).index(name) for name in parameters.free]
    np.testing.assert_allclose(np.diag(numeric[rows]), parameters.diagonal(internal), rtol=1e-8)

    prior = parameters.prior_residuals
    numeric = np.stack(
        [(prior(internal + step * e) - prior(internal - step * e)) / (2 * step) for e in np.eye(3)], axis=1
    )
    np.testing.assert_allclose(parameters.prior_jacobian(), numeric, rtol=1e-8, atol=1e-8)


def test_prior_counts_in_standard_deviations() -> None:
    residuals = mixed().prior_residuals(np.array([9.0, 0.4, math.log(0.2) + 1.0]))
    np.testing.assert_allclose(residuals, [2.0, 2.0])  # the angle by 0.4/0.2, the drag by 1/0.5 on the log


def test_private_parameters_are_expanded() -> None:
    parameters = Parameters(
        [
            Parameter(name="wire_EI", initial=1e-4, log=True),
            Parameter(name="left", initial=0.0, private=True),
            Parameter(name="right", tied_to="left", factor=-1.0, private=True),
            Parameter(name="other_EI", tied_to="wire_EI", private=True),
        ]
    ).expand(["one", "two"])
    assert parameters.free == ("wire_EI", "left[one]", "left[two]")
    values = parameters.to_physical(np.array([math.log(2e-4), 0.1, 0.2]))
    assert values["right[one]"] == -0.1
    assert values["right[two]"] == -0.2
    assert values["other_EI[two]"] == pytest.approx(2e-4)


def test_replace_gives_a_changed_copy() -> None:
    before = mixed()
    after = before.replace("drag", fixed=True, prior=None)
    assert "drag" in before.free
    assert "drag" not in after.free
    with pytest.raises(InputError, match="no such name"):
        before.replace("nothing", fixed=True)


def test_vectors_and_values_of_the_wrong_kind_are_refused() -> None:
    parameters = mixed()
    with pytest.raises(InputError, match="wrong shape"):
        parameters.to_physical(np.zeros(2))
    with pytest.raises(InputError, match="lack free parameters"):
        parameters.to_internal({"angle": 0.1})
    with pytest.raises(InputError, match="positive on a log scale"):
        parameters.to_internal({"angle": 0.1, "rope_EA": -1.0, "drag": 1.0})


def test_a_bound_keeps_its_bits() -> None:
    """The next window of a fit refused a first moment that had ended on its bound: exp(log(x)) was less by rounding."""
    for lower in np.random.default_rng(0).uniform(0.1, 10.0, 100).tolist():
        p = Parameter(name="a", log=True, initial=2.0 * lower, lower=lower, upper=3.0 * lower)
        assert p.to_physical(p.to_internal(lower)) == lower
        assert p.to_physical(p.to_internal(p.upper)) == p.upper
