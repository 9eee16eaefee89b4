"""Arguments of a wrong kind: each public function refuses them by an error that names the argument, or takes them."""

from __future__ import annotations

import importlib
import inspect
import math
import re
import signal
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sheetbend as sb
from sheetbend.arrays.checks import check_count, is_number, some_indices
from sheetbend.optional import MissingExtraError
from wrong_calls import CALLS

LONGEST = 20.0  # s of the processor, for one call


class Strange:
    """What no function knows, and what NumPy cannot convert, as a tensor that has a gradient."""

    def __array__(self, *_: object, **__: object) -> np.ndarray:
        raise RuntimeError("Can't call numpy() on Tensor that requires grad.")


WRONG: dict[str, Any] = {
    "None": None,
    "text": "x",
    "empty text": "",
    "NaN": math.nan,
    "negative": -1,
    "400 digits": 10**400,
    "a thousand million": 10**9,
    "truth value": True,
    "complex": 1j,
    "texts": ["a", "b", "c"],
    "empty list": [],
    "empty mapping": {},
    "ragged": [[1], [1, 2]],
    "object": Strange(),
    "path": Path("/does/not/exist"),
    "NaNs": np.full((3, 3), math.nan),
    "four axes": np.zeros((2, 2, 2, 2)),
    "no axes": np.array(1.0),
    "infinity in single precision": np.float32("inf"),
}
NO_NUMBERS = ("text", "NaN", "complex", "texts", "ragged", "object", "path", "NaNs")  # and no lengths, masses, ...


@pytest.fixture(autouse=True)
def elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Texts are paths of files that are written."""
    monkeypatch.chdir(tmp_path)
    before = signal.signal(signal.SIGPROF, _too_long)
    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore")
        yield
    signal.signal(signal.SIGPROF, before)


def _too_long(*_: object) -> None:
    raise TimeoutError(f"a call took more than {LONGEST:g} s")


def complaint(name: str, argument: str, label: str) -> str:
    """What is wrong with what a call does to a wrong argument; empty if nothing is."""
    call, given = CALLS[name]()
    usual, wrong = given[argument], WRONG[label]
    signal.setitimer(signal.ITIMER_PROF, LONGEST)
    try:
        call(**{**given, argument: wrong})
    except sb.SheetbendError as error:
        return "" if len(str(error)) < 2000 else f"tells {len(str(error))} characters"
    except (TypeError, ValueError) as error:
        told = str(error).lower()
        named = (
            re.search(rf"\b{re.escape(argument.lower())}\b", told) is not None
            or "pathlike" in told
            or ("truth value of an array" in told and isinstance(wrong, np.ndarray))
        )
        return "" if named else f"{type(error).__name__}: {error}"
    except Exception as error:
        return f"{type(error).__name__}: {error}"
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
    return "is taken for a number" if isinstance(usual, float) and label in NO_NUMBERS else ""


@pytest.mark.slow
@pytest.mark.parametrize("name", CALLS)
def test_wrong_arguments_are_refused_by_name(name: str) -> None:
    call, given = CALLS[name]()
    call(**given)  # right as it stands
    found = {(a, label): told for a in given for label in WRONG if (told := complaint(name, a, label))}
    assert not found


def test_every_public_function_is_called() -> None:
    """A new public name gets a call in `wrong_calls.py`, or a reason here to have none."""
    without = {
        *("Arm", "Body", "Cloth", "ContactCounts", "ContactMode", "Equilibrium", "Fit", "FitResult", "ForceBalance"),
        *(
            "Gradient",
            "GradientReport",
            "Joint",
            "ManyFit",
            "OverTime",
            "Place",
            "Plan",
            "Rod",
            "Rollout",
            "Rope",
            "Score",
            "Scores",
            "Solid",
        ),
        *("TapePlan", "Trajectory"),  # results, which functions make
        *("Grip", "Cloud", "SolidMesh", "TriangleMesh"),  # by class methods, and with `mesh.`
        *("Junction", "fit_rope"),  # no arguments; many recordings
    }
    called = {name.split(" ")[0].split(".")[0] for name in CALLS}
    public = {n for n in sb.__all__ if callable(getattr(sb, n)) and not _is_error(getattr(sb, n))}
    assert public - called - without == set()


RESULTS = {  # which functions make, and users do not
    "mesh": {"Places", "SolidPlaces"},
    "textile": {
        *("BendingLoop", "BendingYield", "BiasExtension", "Cantilever", "Curve", "Cycle", "Drape", "DrapeState"),
        *("FabricFit", "MeanCurve", "Outline", "PictureFrame", "PullForecast", "Reading", "Shear", "ShearLoop"),
        *("ShearYield", "TensileLoop", "Uniaxial", "WholeFabric"),
    },
    "gripped": {"Evaluation", "GrippedMotion", "Rung", "RopeFit", "RopeModel", "RopeReport", "Screened", "Step"},
    "torch": {"Equilibrium", "State"},
    "jax": set(),
    "config": {"Config", "GrippedConfig", "GrippedRopeSection", "Study"},
    "plot": {"Field", "Motion"},  # plain data, which `fields` and `motions` check
}
LARGE = {  # what takes results of long fits or motions between grips: its first argument alone is replaced
    "gripped": {"evaluate", "fit_rope", "screened"},
    "plot": {"along", "forces", "over_time"},
}


@pytest.mark.parametrize("module", RESULTS)
def test_every_public_function_of_a_module_is_called(module: str) -> None:
    """A new one gets a call in `wrong_calls_more.py`, or a reason here to have none."""
    try:
        found = importlib.import_module(f"sheetbend.{module}")
    except MissingExtraError:
        pytest.skip(f"{module} needs what is not installed")
    called = {name.split(" ")[0].split(".")[1] for name in CALLS if name.startswith(f"{module}.")}
    public = {n for n in found.__all__ if callable(getattr(found, n)) and not _is_error(getattr(found, n))}
    assert public - called - RESULTS[module] - LARGE.get(module, set()) == set()


@pytest.mark.parametrize(("module", "name"), [(module, name) for module in LARGE for name in sorted(LARGE[module])])
def test_a_wrong_first_argument_is_refused(module: str, name: str) -> None:
    call = getattr(importlib.import_module(f"sheetbend.{module}"), name)
    more = {"evaluate": ([],), "screened": (0.1,)}.get(name, ())
    for label, wrong in WRONG.items():
        if not (name == "screened" and label in ("empty text", "empty list", "empty mapping")):  # nothing to screen
            with pytest.raises(sb.SheetbendError):
                call(wrong, *more)


@pytest.mark.parametrize("call", [sb.gripped.fit_rope, lambda given: sb.gripped.screened(given, 0.1)])
def test_a_generator_of_recordings_is_refused(call: Callable[[object], object]) -> None:
    """The check took its recordings, and the fit began without them."""
    with pytest.raises(sb.SheetbendError, match=r"recordings: must be"):
        call(iter([sb.Recording(np.zeros((30, 6, 3)), np.arange(30.0))]))


def test_infinity_in_single_precision_is_no_number() -> None:
    assert is_number(np.float32(3.0)) and not is_number(np.float32(np.inf))


def test_a_number_out_of_range_is_told_what_to_give() -> None:
    """Once "give fewer" of a seed, and "give one from 0 to 9223372036854775807"."""
    with pytest.raises(sb.SceneError, match=r"at least 0 .*give one from 0 on"):
        check_count("seed", -1, 0, 2**63 - 1)
    with pytest.raises(sb.SceneError, match=r"at most 4 .*give one from -5 to 4"):
        check_count("frame", 5, -5, 4)


def test_one_index_in_an_array_without_axes() -> None:
    assert some_indices("held", np.array(2), 5) == [2]


def _is_error(found: object) -> bool:
    return inspect.isclass(found) and issubclass(found, Exception)
