"""The options of the solver stand once: `sb.Solver` declares them, and [solver] of a configuration follows."""

from __future__ import annotations

import dataclasses
import inspect
from pathlib import Path
from typing import Any, Literal

import pytest
import sheetbend as sb
from sheetbend.config.file import parse
from sheetbend.config.solver_schema import NOT_HERE, SolverSection, solver_for
from sheetbend.motion.options import meanings_of, option, options_of
from sheetbend.motion.solver import OPTIONS

KEYS = [name for name in OPTIONS if name not in NOT_HERE]
REFUSED: dict[str, Any] = {
    "h": 0.0,
    "iterations": 0,
    "threads": 0,
    "grain": 0,
    "force_tolerance": 0.1,
    "cg_tolerance": 0.0,
    "cg_iterations": 0,
    "memory": "2 XB",
    "extrapolate": 4,
}
CHOSEN: dict[str, Any] = {
    "h": 0.002,
    "integrator": "bdf1",
    "method": "newton_cg",
    "iterations": 7,
    "force_tolerance": 1e-8,
    "cg_tolerance": 1e-9,
    "cg_iterations": 50,
    "memory": "2 GB",
    "extrapolate": 2,
}


def written(folder: Path, solver: str) -> Path:
    path = folder / "scene.toml"
    path.write_text(f'[experiment]\nname = "scene"\n[solver]\n{solver}\n[scene]\n')
    return path


def test_every_option_says_what_it_is_and_when_it_is_refused() -> None:
    assert [name for name, one in OPTIONS.items() if not one.meaning] == []
    assert list(inspect.signature(sb.Solver).parameters) == list(OPTIONS)
    by_range = {name for name, one in OPTIONS.items() if one.annotation in (int, float, int | None, str | int | None)}
    assert by_range == set(REFUSED)


def test_every_option_has_a_key_with_its_default_and_its_description() -> None:
    keys = SolverSection.model_fields
    assert sorted(set(keys) - {"substeps"}) == sorted(KEYS)
    for name in set(KEYS) - {"h"}:
        assert keys[name].default == OPTIONS[name].default == getattr(sb.Solver(), name)
        assert keys[name].description == OPTIONS[name].meaning


def test_every_key_reaches_the_solver(tmp_path: Path) -> None:
    lines = [f'{name} = "{v}"' if isinstance(v, str) else f"{name} = {v}" for name, v in CHOSEN.items()]
    assert sorted(CHOSEN) == sorted(KEYS)
    assert all(CHOSEN[name] != OPTIONS[name].default for name in KEYS)
    section = parse(written(tmp_path, "\n".join(lines))).solver
    assert solver_for(section, None) == sb.Solver(**CHOSEN)


@pytest.mark.parametrize("name", REFUSED)
def test_both_refuse_in_the_same_words(name: str, tmp_path: Path) -> None:
    value = REFUSED[name]
    with pytest.raises(sb.InputError) as direct:
        sb.Solver(**{name: value})
    assert direct.value.field == f"solver.{name}" and direct.value.got == value
    if name in NOT_HERE:
        return
    with pytest.raises(sb.ConfigError) as told:
        parse(written(tmp_path, f'{name} = "{value}"' if isinstance(value, str) else f"{name} = {value}"))
    assert vars(told.value) == vars(direct.value)


def test_what_does_not_go_together_names_the_key(tmp_path: Path) -> None:
    section = parse(written(tmp_path, 'extrapolate = 2\nmethod = "gauss_seidel"')).solver
    with pytest.raises(sb.ConfigError) as told:
        solver_for(section, None)
    assert told.value.field == "solver.extrapolate"


def test_true_is_no_number() -> None:
    for name in ("h", "iterations", "extrapolate"):
        with pytest.raises(sb.InputError, match="must be a"):
            sb.Solver(**{name: True})


def test_a_new_option_needs_no_other_place() -> None:
    @dataclasses.dataclass(frozen=True)
    class Toy:
        """A toy.

        Attributes:
            share, part: what is kept,
                and what is not.
            way: "up" or "down".

        Another paragraph: not an attribute.
        """

        share: float = option(0.5, above=0, most=1)
        part: int | None = option(None, least=2)
        way: Literal["up", "down"] = option("up")

    assert meanings_of(Toy) == {
        "share": "what is kept, and what is not.",
        "part": "what is kept, and what is not.",
        "way": '"up" or "down".',
    }
    own = options_of(Toy)
    own["part"].check("toy", None)
    own["share"].check("toy", 1)
    for name, value, words in (
        ("share", 0.0, r"must be a number greater than 0 and of at most 1 .*such as 0.5"),
        ("share", float("nan"), "must be a number"),
        ("share", None, "must be a number"),
        ("part", 2.0, "must be a whole number of at least 2"),
        ("way", "left", "use one of: up, down"),
    ):
        with pytest.raises(sb.InputError, match=words) as told:
            own[name].check("toy", value)
        assert told.value.field == f"toy.{name}"
