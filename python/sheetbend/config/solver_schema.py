"""[solver]: the options of `sheetbend.Solver`, which declares them, and how its substep follows from recordings."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, Self

import numpy as np
from pydantic import AfterValidator, create_model, model_validator

from ..errors import InputError
from ..experiment.checks import check_substep
from ..motion.options import Option
from ..motion.solver import OPTIONS, Solver, check_option
from ..recording.recording import Recording
from .errors import located
from .section import Finite, Section, key

SUBSTEPS = 10
NOT_HERE = ("threads", "grain")
"""Options that change no result: a configuration says `fit.threads`."""


def _checked(option: Option) -> AfterValidator:
    def check(value: Any) -> Any:
        try:
            if value is not None:
                check_option(option.name, value)
        except InputError as error:
            raise ValueError(f"{error.problem}|{error.fix}") from error
        return value

    return AfterValidator(check)


class _Substep(Section):
    """[solver]: time step and method of the simulation."""

    substeps: int | None = key(
        None, "substeps per frame interval of each recording (its median); 10 when h is left out too", ge=1
    )
    h: Annotated[Finite | None, _checked(OPTIONS["h"])] = key(
        None, f"the substep itself, instead of `substeps`; without a recording {OPTIONS['h'].default:g} by default", "s"
    )

    @model_validator(mode="after")
    def _one_of_both(self) -> Self:
        if self.h is not None and self.substeps is not None:
            raise ValueError("has both h and substeps|give one of them")
        return self


_KEYS: dict[str, Any] = {
    name: (Annotated[option.annotation, _checked(option)], key(option.default, option.meaning, option.limits.unit))
    for name, option in OPTIONS.items()
    if name not in (*NOT_HERE, "h")
}

if TYPE_CHECKING:
    SolverSection = _Substep
else:
    SolverSection = create_model("SolverSection", __base__=_Substep, __doc__=_Substep.__doc__, **_KEYS)


def solver_for(section: SolverSection, recording: Recording | None, static: bool = False) -> Solver:
    """The solver, its substep taken from the recording's median frame interval where `h` is not given.

    Raises:
        ConfigError: the substep is too long for the motion; of a `static` recording it does not matter.
    """
    given = section.model_dump(exclude={"substeps"}, exclude_none=True)
    if "h" not in given and recording is not None and len(recording.times) > 1:
        given["h"] = float(np.median(np.diff(recording.times))) / (section.substeps or SUBSTEPS)
    with located("solver", "solver"):
        solver = Solver(**given)
        if recording is not None and not static:
            check_substep(solver.h, recording.times)
    return solver
