"""How much of a fit its journal takes: processor time inside the journal's own calls against that of the whole fit, and
its commits per second.

    python tools/journal_share.py [--kinds ceres scipy] [--size 6] [--seed 0]

Processor time, since the clock of a shared machine also counts others. `--size` makes the fits of `kills` longer.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import kills
from sheetbend.problem import digests, journal


@dataclass
class Taken:
    """What the journals of this process took.

    Attributes:
        seconds: s of processor time in their calls, evaluations left out.
        longest: s by the clock, that of their longest call.
        read, made, kept: evaluations.
        commits: to the file.
    """

    seconds: float = 0.0
    longest: float = 0.0
    read: int = 0
    made: int = 0
    kept: int = 0
    commits: int = 0

    def measured(self, call: Callable[..., Any], *given: Any, **more: Any) -> Any:
        """The result of a call of the journal, its time added."""
        began, clock = time.thread_time(), time.perf_counter()
        try:
            return call(*given, **more)
        finally:
            self.seconds += time.thread_time() - began
            self.longest = max(self.longest, time.perf_counter() - clock)


def watched(taken: Taken) -> type[journal.Journal]:
    """Journals that count into `taken`."""

    class Watched(journal.Journal):
        def __init__(self, *given: Any, **more: Any) -> None:
            taken.measured(super().__init__, *given, **more)
            taken.commits += 1

        def problem(self, made_from: Any) -> bytes:
            return taken.measured(super().problem, made_from)

        def evaluate(self, problem: Any, u: Any, jacobian: Any, make: Any, state: Any = bytes) -> Any:
            inside, clock = 0.0, 0.0

            def timed() -> Any:
                nonlocal inside, clock
                began, at = time.thread_time(), time.perf_counter()
                found = make()
                inside, clock = time.thread_time() - began, time.perf_counter() - at
                return found

            began, at, committed = time.thread_time(), time.perf_counter(), self._committed
            found = super().evaluate(problem, u, jacobian, timed, state)
            taken.commits += self._committed != committed
            taken.seconds += time.thread_time() - began - inside
            taken.longest = max(taken.longest, time.perf_counter() - at - clock)
            return found

        def close(self) -> None:
            taken.read, taken.made, taken.kept = taken.read + self.read, taken.made + self.made, taken.kept + len(self)
            taken.commits += self._db.in_transaction
            taken.measured(super().close)

    return Watched


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kinds", nargs="+", default=["ceres", "scipy"])
    parser.add_argument("--size", type=int, default=6)
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    plain, of_problem = journal.Journal, digests.of_problem
    for kind in given.kinds:
        taken = Taken()
        journal.Journal = watched(taken)  # type: ignore[misc]
        digests.of_problem = partial(taken.measured, of_problem)
        with tempfile.TemporaryDirectory() as folder:
            kills.prepare(kind, given.seed, Path(folder))
            began, clock = time.process_time(), time.perf_counter()
            kills.fitted(kind, given.seed, Path(folder), str(Path(folder) / "journal"), given.size)
            whole, clock = time.process_time() - began, time.perf_counter() - clock
        journal.Journal, digests.of_problem = plain, of_problem  # type: ignore[misc]
        print(
            f"{kind}: {whole:.1f} s of processor time ({clock:.1f} s by the clock), the journal {taken.seconds:.3f} s, "
            f"{100 * taken.seconds / whole:.2f} %; {taken.made} evaluations, {taken.kept} kept, {taken.read} read, "
            f"{taken.commits} commits, {taken.commits / clock:.1f} a second; longest call {1e3 * taken.longest:.1f} ms",
            flush=True,
        )


if __name__ == "__main__":
    main()
