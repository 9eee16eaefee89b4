"""Errors that users meet: each names the field, what it got and how to put it right."""

from __future__ import annotations

import difflib
import reprlib
from collections.abc import Collection


class _Short(reprlib.Repr):
    """Values as messages show them."""

    def repr_int(self, x: int, level: int) -> str:
        try:
            return super().repr_int(x, level)
        except ValueError:  # Python writes no more than 4,300 digits; TOML reads any number of hexadecimal ones
            return f"an integer of {x.bit_length()} bits"


_short = _Short()
_short.maxstring = _short.maxother = 120


class SheetbendError(Exception):
    """Base of every error that sheetbend raises on purpose."""


class InputError(SheetbendError, ValueError):
    """An input is wrong; raised before any work starts.

    Args:
        field: the field, argument or file at fault, as the user writes it.
        problem: what is wrong with it, or what it must be.
        got: the offending value itself (shown shortened).
        fix: what to do about it, as an instruction.
    """

    def __init__(self, field: str, problem: str, got: object, fix: str) -> None:
        super().__init__(field, problem, got, fix)
        self.field = field
        self.problem = problem
        self.got = got
        self.fix = fix

    def __str__(self) -> str:
        return f"{self.field}: {self.problem} (got {_short.repr(self.got)}). Fix: {self.fix}."


def refusal(error: ValueError, kind: type[InputError], got: object) -> InputError:
    """What the core refuses ("field: problem. Fix: what to do") as an error of the package."""
    field, _, rest = str(error).partition(": ")
    problem, _, fix = rest.partition(". Fix: ")
    return kind(field, problem, got, fix or "see above")


def choices(name: object, known: Collection[str]) -> str:
    """A fix for a name that is not known: the ones most like it, in spelling, in other letters' case, or as their last
    part; and all."""
    text = str(name)
    near = [k for k in known if k.endswith(f"_{text}") or k.lower() == text.lower()]
    near = near or difflib.get_close_matches(text, list(known), n=1)
    if not near:
        return f"name one of: {', '.join(known)}"
    return f"did you mean {' or '.join(repr(k) for k in near)}? There are: {', '.join(known)}"


class SceneError(InputError):
    """A scene (particles, constraints, boundary) is inconsistent."""


class RecordingError(InputError):
    """A recording, or a file that should hold one, is inconsistent."""


class MeshError(InputError):
    """A mesh, or a file that should hold one, is inconsistent."""


class ConfigError(InputError):
    """A configuration has an unknown key, a wrong value or a missing one."""


class DivergenceError(SheetbendError, RuntimeError):
    """A simulation diverged: a number is not finite, or a state or a gradient is far outside of what is possible.

    A finite state counts as diverged if it is far beyond the energy put into the scene: particles that move too fast,
    constraints stretched to several times their width, a scene shrunk to a point. A gradient counts as diverged if it
    grows by more than 1/eps = 4.5e15 during the backward pass, so that it consists of rounding errors.

    Args:
        substep: index of the substep after which it was noticed, from 0. Finite states are checked every 32 substeps
            and at the end.
        time: its time, s.
        particle: index of the first diverged particle.
        where: what was being computed, in words (solver, constraint group).
        seen: what the particle does, as the message says it.
    """

    def __init__(self, substep: int, time: float, particle: int, where: str, seen: str = "is not finite") -> None:
        super().__init__(substep, time, particle, where, seen)
        self.substep = substep
        self.time = time
        self.particle = particle
        self.where = where
        self.seen = seen

    def __str__(self) -> str:
        fix = (
            "end the motion earlier, or differentiate it in shorter pieces"
            if "gradient" in self.seen
            else "use a smaller substep or more iterations, and check masses, forces and boundary motion near that time"
        )
        return (
            f"the rollout diverged: particle {self.particle} {self.seen}, after substep {self.substep} "
            f"(t = {self.time:.6g} s), in {self.where}. Fix: {fix}."
        )


class UnconvergedError(SheetbendError, RuntimeError):
    """Conjugate gradients (method "newton_cg") did not converge within `Solver.cg_iterations`.

    Args:
        iterations: the largest allowed number.
        residual: at the end, relative to the right side.
        where: what was being computed, in words.
    """

    def __init__(self, iterations: int, residual: float, where: str) -> None:
        super().__init__(iterations, residual, where)
        self.iterations = iterations
        self.residual = residual
        self.where = where

    def __str__(self) -> str:
        return (
            f"conjugate gradients did not converge: after {self.iterations} iterations the residual is still "
            f"{self.residual:.1e} of the right side, in {self.where}. Fix: raise solver.cg_iterations, use a smaller "
            "substep, or method 'newton' where its factor fits in memory."
        )


class UnbalancedError(SheetbendError, RuntimeError):
    """The forces of a substep (method "implicit") do not balance, or they balance at a point of buckling, where the
    solution has no derivative.

    Args:
        problem: what happened, in words.
        fix: what to do about it.
        substep: number of the substep.
        time: at its end, s.
        particle: the one with the largest unbalanced force.
        residual: largest unbalanced force, relative to the largest force.
        where: what was being computed, in words.
    """

    def __init__(
        self, problem: str, fix: str, substep: int, time: float, particle: int, residual: float, where: str
    ) -> None:
        super().__init__(problem, fix, substep, time, particle, residual, where)
        self.problem = problem
        self.fix = fix
        self.substep = substep
        self.time = time
        self.particle = particle
        self.residual = residual
        self.where = where

    def __str__(self) -> str:
        when = f"in substep {self.substep} (t = {self.time:.6g} s) of {self.where}"
        return f"{self.problem}, {when}. Fix: {self.fix}."


class NoEquilibriumError(SheetbendError, RuntimeError):
    """The solver did not reach an equilibrium from the given start; the message says why, and what to try."""


class EmptyGradientError(SheetbendError, RuntimeError):
    """A loss does not depend on the quantities that an optimizer would change: its gradient is zero or rounding errors.

    Args:
        names: the quantities.
        change: the largest change of the loss when one of them moves by its scale, to first order.
        rounding: the change of the loss when its positions are rounded; zero if it depends on no position.
    """

    def __init__(self, names: tuple[str, ...], change: float, rounding: float) -> None:
        super().__init__(names, change, rounding)
        self.names = names
        self.change = change
        self.rounding = rounding

    def __str__(self) -> str:
        names = ", ".join(self.names[:3]) + (f" and {len(self.names) - 3} more" if len(self.names) > 3 else "")
        if self.rounding == 0.0:
            return (
                "the gradient is empty: the loss has no derivative with respect to any position here, so it cannot "
                "feel "
                f"{names}. Fix: start where it has one, such as where a hinge is violated, or check its weights."
            )
        return (
            f"the gradient is empty: moving {names} by its scale changes the loss by {self.change:.1e} at most, and "
            f"rounding alone by {self.rounding:.1e}. What the loss looks at does not feel them: motion after the last "
            "frame, a slack or soft rope through which it has not arrived, a contact that nothing touches yet, or a "
            "symmetric start. Fix: let the loss look later, or start elsewhere, such as where something touches."
        )
