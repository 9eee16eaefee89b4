"""What the profiles of a fit cost, and how near their ends are to those of refits.

    python experiments/bench/profiles.py experiments/wires/wires.toml experiments/twin_cloth/twin_cloth.toml
    python experiments/bench/profiles.py --every --refits 2 experiments/held_cloth/held_cloth.toml

Each configuration is fitted as `sheetbend fit` does. Every profile that its intervals ask for is counted; its ends are
then looked for once more by refits of all other parameters, from the linear picture on. With --every, profiles are made
where a configuration or the recipe for gripped ropes asks for linear intervals too.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path

import numpy as np
from sheetbend.cli.app import app
from sheetbend.doubts.profiles import Profiles
from sheetbend.fitting import fit as fitting
from sheetbend.fitting.conclusion import Asked
from sheetbend.minimum.profile_path import ProfilePath
from sheetbend.problem.coordinates import step_limits
from sheetbend.problem.counts import counted
from sheetbend.statistics.profile import Profile, Wanted, profile_interval
from typer.testing import CliRunner


@dataclass
class Study:
    """What the profiles of one configuration took.

    Attributes:
        refits: of how many parameters the ends are compared with those of refits.
        off: of each end that both ways found, the distance over the width of the linear interval.
        open: ends that only one of both ways found.
    """

    refits: int
    evaluations: int = 0
    jacobians: int = 0
    seconds: float = 0.0
    refit_seconds: float = 0.0
    names: list[str] = field(default_factory=list)
    off: dict[str, float] = field(default_factory=dict)
    open: list[str] = field(default_factory=list)

    def each(self, profiles: Profiles, wanted: list[Wanted]) -> list[Profile]:
        """In the place of `Profiles.each`."""
        before, began = counted(), time.process_time()
        found = [profiles.profile(one) for one in wanted]
        after = counted()
        self.seconds += time.process_time() - began
        self.evaluations += after[0] - before[0]
        self.jacobians += after[1] - before[1]
        compared = max(self.refits - len(self.names), 0)
        self.names += [one.name for one in wanted]
        began = time.process_time()
        for one, profile in list(zip(wanted, found, strict=True))[:compared]:
            self._compare(profiles, one, profile)
        self.refit_seconds += time.process_time() - began
        return found

    def _compare(self, profiles: Profiles, wanted: Wanted, profile: Profile) -> None:
        problem, name = profiles._problem, wanted.name
        p, column = problem.parameters[name], problem.parameters.free.index(name)
        part = profiles._part(name)
        linear = profiles._picture(part)
        if linear is None:
            return
        own, limits = part.parameters.free.index(name), part.parameters.limits()
        rise = ProfilePath(part.evaluate, linear, own, wanted.reach, limits, step_limits(part.parameters)).rise
        estimate = p.to_physical(float(profiles._u[column] + profiles._moved[column]))
        step = min(wanted.reach, 1.0) if p.log else wanted.reach
        cost = partial(profiles.__call__, name)
        ends = profile_interval(cost, estimate, rise, step=step, lower=p.lower, upper=p.upper, log=p.log)
        for side, a, b in zip(("lower", "upper"), profile.ends, ends, strict=True):
            if a is None or b is None or not np.isfinite([a, b]).all():
                if a is not b:
                    self.open.append(f"{name} {side}")
                continue
            self.off[f"{name} {side}"] = 0.5 * abs(p.to_internal(a) - p.to_internal(b)) / wanted.reach


def row(file: Path, study: Study) -> str:
    """A row of Markdown."""
    n = max(len(study.names), 1)
    worst = max(study.off, key=lambda end: study.off[end], default="")
    far = f"{100 * study.off[worst]:.2g} % ({worst})" if worst else ""
    over = sum(off > 0.01 for off in study.off.values())
    return (
        f"| {file.stem} | {len(study.names)} | {study.jacobians / n:.1f} | {study.evaluations / n:.1f} | {far} "
        f"| {over} of {len(study.off)} | {', '.join(study.open)} | {study.seconds:.2g} ({study.refit_seconds:.3g}) |"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("configurations", nargs="+", type=Path)
    parser.add_argument("--every", action="store_true", help="profiles where linear intervals are asked for too")
    parser.add_argument("--refits", type=int, default=sys.maxsize, help="of that many parameters; 0 counts alone")
    given = parser.parse_args()
    if given.every:
        fitting.Asked = lambda *asked: replace(Asked(*asked), profiles=True)  # type: ignore[misc,assignment]
    print(
        "| experiment | parameters | Jacobians per parameter | evaluations | farthest from refits, of the width "
        "| ends beyond 1 % of it | found by one way alone | seconds of all profiles (of refits) |"
    )
    print("| --- | --- | --- | --- | --- | --- | --- | --- |")
    for file in given.configurations:
        study = Study(given.refits)
        Profiles.each = lambda profiles, wanted, study=study: study.each(profiles, wanted)  # type: ignore[method-assign]
        with tempfile.TemporaryDirectory() as folder:
            told = CliRunner().invoke(app, ["fit", str(file), "--output", folder])
        if told.exception is not None and not isinstance(told.exception, SystemExit):
            raise told.exception
        print(row(file, study), flush=True)


if __name__ == "__main__":
    main()
