"""What a fit may change: named physical parameters, their bounds, scales, ties and priors.

The optimizer works on an *internal* vector: one entry per free parameter, the natural logarithm of the value
where the parameter has a log scale, the value itself elsewhere. Everything else (scenes, reports, files)
sees physical values.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from ..arrays.checks import is_bound, is_number, is_several
from ..arrays.types import Array
from ..errors import InputError

DEFAULT_RANGE = 1e6
"""Factor either way from its initial value within which a search keeps a parameter on a log scale without bounds."""
RESTS = 1e-3  # of a logarithm: so near a limit a parameter has run off


@dataclass(frozen=True, kw_only=True)
class Parameter:
    """A parameter of a fit: its initial value, bounds and prior.

    Examples:
        >>> weighed = sb.Parameter(name="rope_density", initial=0.05, prior=(0.05, 0.001))  # kg/m, mean and sd
        >>> stiffness = sb.Parameter(name="rope_EI", initial=1e-3, lower=1e-5, upper=1e-1)  # N m^2

    Attributes:
        name: the `<group>_<quantity>` name used in scenes, files and reports.
        initial: the starting value, in `unit`. A tied parameter has none; a private one may leave it out and
            starts at the value of each recording's own scene.
        lower, upper: bounds, in `unit`.
        log: fit the natural logarithm (for quantities that are positive and known by their order of
            magnitude).
        fixed: keep the initial value.
        tied_to: the parameter that this one follows: value = factor * value of `tied_to`.
        factor: see `tied_to`.
        prior: (mean, sd). The mean is in `unit`; the sd too, but with `log` it is that of the natural
            logarithm (0.1 means about 10 %).
        unit: SI unit, for reports.
        private: one value per recording instead of one for all of them.
        scale: a natural size in `unit` for a parameter that may well be zero (angles, offsets): precision is
            then judged against it instead of against the value.

    Raises:
        InputError: a field is inconsistent; the message names it.
    """

    name: str
    initial: float | None = None
    lower: float = -math.inf
    upper: float = math.inf
    log: bool = False
    fixed: bool = False
    tied_to: str | None = None
    factor: float = 1.0
    prior: tuple[float, float] | None = None
    unit: str = ""
    private: bool = False
    scale: float | None = None

    def __post_init__(self) -> None:
        if not isinstance(self.name, str) or not self.name.strip():
            raise InputError("parameter.name", "must be a text", self.name, "give a name such as 'rope_EI'")
        if self.tied_to is None:
            self._check_value()
        else:
            self._check_tie()
        if self.scale is not None and not (is_number(self.scale) and self.scale > 0):
            self._fail("scale", "must be a size", self.scale, "give a positive number, such as 0.1 rad for an angle")

    def _fail(self, field: str, problem: str, got: object, fix: str) -> NoReturn:
        raise InputError(f"{self.name}.{field}", problem, got, fix)

    def _check_value(self) -> None:
        initial = self.initial
        if initial is None and self.private:
            return  # checked when expanded, with the values of the scenes
        if initial is None or not is_number(initial):
            self._fail("initial", "must be a finite number", initial, "give a starting value")
        for bound in ("lower", "upper"):
            value = getattr(self, bound)
            if not is_bound(value):
                self._fail(bound, "must be a number", value, f"give one, or leave {bound} out for none")
        if not self.lower < self.upper:
            problem = f"must be below upper, which is {self.upper:g}"
            self._fail("lower", problem, self.lower, "lower it, or raise upper")
        if self.log and initial <= 0:
            self._fail("initial", "must be positive on a log scale", self.initial, "raise it or set log = false")
        if self.log and self.lower <= 0 and math.isfinite(self.lower):
            self._fail("lower", "must be positive on a log scale", self.lower, "raise it, or leave it out for none")
        if not self.lower <= initial <= self.upper:
            problem = f"lies outside its bounds [{self.lower:g}, {self.upper:g}]"
            self._fail("initial", problem, self.initial, "start inside the bounds, or widen them")
        if self.factor != 1.0:
            self._fail("factor", "belongs to a tie", self.factor, "name the other parameter in tied_to, or drop it")
        if self.prior is not None:
            self._check_prior(self.prior)

    def _check_prior(self, prior: tuple[float, float]) -> None:
        if self.fixed:
            self._fail("prior", "has no effect on a fixed parameter", self.prior, "free it, or drop the prior")
        if not isinstance(prior, Sequence) or len(prior) != 2 or not all(is_number(part) for part in prior):
            self._fail("prior", "must be two finite numbers", self.prior, "give (mean, sd)")
        mean, sd = prior
        if sd <= 0:
            self._fail("prior", "must have a positive sd", self.prior, "raise the sd, or fix the parameter")
        if self.log and mean <= 0:
            self._fail("prior", "must have a positive mean on a log scale", self.prior, "raise the mean")

    def _check_tie(self) -> None:
        problem = f"is given, but {self.name} follows {self.tied_to}"
        for field in ("initial", "prior"):
            if getattr(self, field) is not None:
                self._fail(field, problem, getattr(self, field), f"set the {field} of {self.tied_to}")
        if self.fixed:
            self._fail("fixed", problem, True, f"fix {self.tied_to}, or drop the tie")
        for bound in ("lower", "upper"):
            if is_number(getattr(self, bound)):
                self._fail(bound, problem, getattr(self, bound), f"set {bound} of {self.tied_to}")
        if not is_number(self.factor) or self.factor == 0:
            self._fail("factor", "must be finite and not zero", self.factor, "give the ratio of the two values")

    @property
    def free(self) -> bool:
        """Whether the optimizer has an entry of its own for this parameter."""
        return not self.fixed and self.tied_to is None

    def to_internal(self, value: float) -> float:
        """The internal coordinate of a physical value."""
        if not self.log:
            return float(value)
        return math.log(value) if value > 0 else -math.inf

    def to_physical(self, internal: float) -> float:
        """The physical value of an internal coordinate; infinite, or the least positive one, where an optimizer strays
        too far. That of a bound is the bound, without a rounding that would be outside."""
        for bound in (self.lower, self.upper):
            if internal == self.to_internal(bound):
                return bound
        with np.errstate(over="ignore", under="ignore"):
            return max(float(np.exp(internal)), float(np.finfo(float).tiny)) if self.log else float(internal)


class Parameters(Mapping[str, Parameter]):
    """An ordered mapping from name to `Parameter`, and the map between internal vectors and physical values.

    Raises:
        InputError: two parameters share a name, a tie leads nowhere or in a circle, or nothing is left to
            fit.
    """

    def __init__(self, parameters: Iterable[Parameter]) -> None:
        self._parameters: dict[str, Parameter] = {}
        if not is_several(parameters):
            raise InputError("parameters", "must be a list", parameters, "give [sb.Parameter(name=...)]")
        for parameter in parameters:
            if not isinstance(parameter, Parameter):
                raise InputError("parameters", "hold no Parameter", parameter, "give sb.Parameter(name=...)")
            if parameter.name in self._parameters:
                raise InputError("parameters", "hold a name twice", parameter.name, "give each a name of its own")
            self._parameters[parameter.name] = parameter
        self._roots = {name: self._root(name) for name in self._parameters}
        self.free: tuple[str, ...] = tuple(name for name, parameter in self.items() if parameter.free)
        if not self.free:
            raise InputError("parameters", "leave nothing to fit", list(self), "free at least one: fixed = false")
        self._column = {name: column for column, name in enumerate(self.free)}

    def __getitem__(self, name: str) -> Parameter:
        return self._parameters[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._parameters)

    def __len__(self) -> int:
        return len(self._parameters)

    def __repr__(self) -> str:
        return f"Parameters({', '.join(self)})"

    def _root(self, name: str) -> tuple[str, float]:
        """Follow ties to the parameter that carries the value; also the product of the factors on the way."""
        path, factor, here = [name], 1.0, self._parameters[name]
        while here.tied_to is not None:
            if here.tied_to not in self._parameters:
                known = ", ".join(other for other in self if other != here.name) or "none"
                raise InputError(f"{here.name}.tied_to", "is not a parameter", here.tied_to, f"name one of: {known}")
            target = self._parameters[here.tied_to]
            if target.private and not here.private:
                fix = "set private = true here too"
                raise InputError(f"{here.name}.tied_to", "has one value per recording", target.name, fix)
            if target.name in path:
                circle = " -> ".join([*path, target.name])
                raise InputError(f"{name}.tied_to", "leads back to itself", circle, "break the circle of ties")
            path.append(target.name)
            factor, here = factor * here.factor, target
        return here.name, factor

    @property
    def roots(self) -> Mapping[str, tuple[str, float]]:
        """For every name, the parameter that carries its value (itself, or the end of its ties) and the factor to
        it."""
        return self._roots

    def replace(self, name: str, **changes: Any) -> Parameters:
        """The same parameters with fields of one changed, such as `replace("rope_EA", fixed=True)`.

        Args:
            name: of the parameter.
            changes: fields of `Parameter` and their new values.

        Raises:
            InputError: no parameter has this name; a field with a value that `Parameter` refuses.
        """
        if name not in self:
            raise InputError("parameters", "have no such name", name, f"name one of: {', '.join(self)}")
        return Parameters(replace(p, **changes) if p.name == name else p for p in self.values())

    def starting_at(self, internal: Array) -> Parameters:
        """The same parameters, of which the free ones start at an internal point (free,)."""
        at = self.to_physical(internal)
        return Parameters(replace(p, initial=at[p.name]) if p.name in self._column else p for p in self.values())

    def expand(self, recordings: Sequence[str], own: Mapping[str, float] | None = None) -> Parameters:
        """Turn each private parameter into one per recording, named `name[recording]`; shared ones stay.

        Args:
            recordings: names.
            own: start of private parameters without an initial value, by expanded name and in the parameter's unit.
                A private parameter without either is left out.
        """
        own = own or {}
        expanded: list[Parameter] = []
        for parameter in self.values():
            if not parameter.private:
                expanded.append(parameter)
                continue
            for recording in recordings:
                target = parameter.tied_to
                if target is not None and self[target].private:
                    target = f"{target}[{recording}]"
                name, initial = f"{parameter.name}[{recording}]", parameter.initial
                if initial is None and target is None:
                    if name not in own:
                        continue
                    initial = own[name]
                expanded.append(replace(parameter, name=name, initial=initial, tied_to=target, private=False))
        return Parameters(expanded)

    def initial(self) -> Array:
        """Internal starting vector, shape (free,)."""
        return np.array([self[name].to_internal(self._start(name)) for name in self.free])

    def bounds(self) -> tuple[Array, Array]:
        """Internal lower and upper bounds, each of shape (free,); infinite where there is none."""
        lower = np.array([self[name].to_internal(self[name].lower) for name in self.free])
        upper = np.array([self[name].to_internal(self[name].upper) for name in self.free])
        return lower, upper

    def inside(self, u: Array) -> NDArray[np.bool_]:
        """(free,) bool, what does not stand at one of `limits` at u (free,). What does takes up no residuals: a fit
        would have taken what that step takes off them."""
        near = 1e-6 * np.maximum(np.abs(u), 1e-3)
        lower, upper = self.limits()
        return (u - lower > near) & (upper - u > near)

    def limits(self) -> tuple[Array, Array]:
        """Internal bounds that a search keeps to, each of shape (free,): the user's, and `DEFAULT_RANGE` either way
        from the initial value for a parameter on a log scale that has none on that side. An end there has run off."""
        lower, upper = self.bounds()
        log = np.array([self[name].log for name in self.free])
        far = np.where(log, math.log(DEFAULT_RANGE), math.inf)
        start = self.initial()
        return (
            np.where(np.isfinite(lower), lower, start - far),
            np.where(np.isfinite(upper), upper, start + far),
        )

    def ran_off(self, internal: Array) -> tuple[str, ...]:
        """Names of free parameters that have gone to a limit that no user set; internal: shape (free,)."""
        internal, bounds, limits = self._vector(internal), self.bounds(), self.limits()
        at = [
            (abs(internal - limit) < RESTS) & ~np.isfinite(bound) & np.isfinite(limit)
            for limit, bound in zip(limits, bounds, strict=True)
        ]
        return tuple(name for name, lower, upper in zip(self.free, *at, strict=True) if lower or upper)

    def to_internal(self, values: Mapping[str, float]) -> Array:
        """Internal vector, shape (free,), of the physical values of the free parameters."""
        missing = [name for name in self.free if name not in values]
        if missing:
            raise InputError("values", "lack free parameters", missing, "give every free parameter a value")
        for name in self.free:
            if self[name].log and not values[name] > 0:
                raise InputError(name, "must be positive on a log scale", values[name], "give a positive value")
        return np.array([self[name].to_internal(values[name]) for name in self.free])

    def to_physical(self, internal: Array) -> dict[str, float]:
        """Physical values of all parameters (free, fixed, tied), in order; internal: shape (free,)."""
        internal = self._vector(internal)
        values: dict[str, float] = {}
        for name, (root, factor) in self._roots.items():
            column = self._column.get(root)
            carried = self._start(root) if column is None else self[root].to_physical(internal[column])
            values[name] = factor * carried
        return values

    def diagonal(self, internal: Array) -> Array:
        """d physical / d internal of the free ones, shape (free,): the value on a log scale, 1 elsewhere."""
        internal = self._vector(internal)
        log = np.array([self[name].log for name in self.free])
        return np.where(log, np.exp(np.where(log, internal, 0.0)), 1.0)

    def chain(self, internal: Array) -> Array:
        """d (all physical values) / d internal, shape (all, free).

        With a Jacobian in all physical values, `jacobian @ chain(internal)` is the one in internal
        coordinates; a cotangent goes back through the transpose.
        """
        diagonal = self.diagonal(internal)
        matrix = np.zeros((len(self), len(self.free)))
        for row, (root, factor) in enumerate(self._roots.values()):
            if root in self._column:
                column = self._column[root]
                matrix[row, column] = factor * diagonal[column]
        return matrix

    def prior_residuals(self, internal: Array) -> Array:
        """(internal value - prior mean)/sd for each parameter that has a prior, shape (priors,), in order."""
        internal = self._vector(internal)
        return np.array([(internal[column] - mean) / sd for column, mean, sd in self._priors()])

    def prior_jacobian(self) -> Array:
        """Derivative of `prior_residuals`, shape (priors, free); it is constant."""
        priors = self._priors()
        matrix = np.zeros((len(priors), len(self.free)))
        for row, (column, _, sd) in enumerate(priors):
            matrix[row, column] = 1.0 / sd
        return matrix

    def _priors(self) -> list[tuple[int, float, float]]:
        """Column, internal mean and sd of each prior."""
        every = ((column, self[name], self[name].prior) for name, column in self._column.items())
        return [(column, p.to_internal(prior[0]), prior[1]) for column, p, prior in every if prior is not None]

    def _start(self, name: str) -> float:
        initial = self[name].initial
        assert initial is not None  # only tied parameters lack one, and no value starts there
        return initial

    def _vector(self, internal: Array) -> Array:
        vector = np.asarray(internal, dtype=float)
        if vector.shape != (len(self.free),):
            raise InputError("internal", "has the wrong shape", vector.shape, f"give shape ({len(self.free)},)")
        return vector
