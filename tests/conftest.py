"""What holds for all tests.

One thread per process, since numerical libraries would otherwise start a pool each, whose threads wait for each other
where there are more of them than cores. Ctrl-C works in tests even where they are started in the background, where
shells have it ignored.

Tests that take more than 0.4 s of the processor, or 2 s in all of their cases, are marked as slow, as those are whose
source says so because they take seconds. slow_tests.txt lists them. This measures them again, in one process:

    pytest --record-slow

Choose whole files where you do not measure all. The first test of a file pays for what its tests share (imports, data
of the module): a second run that leaves this test out marks the next one, however quick it is.
"""

from __future__ import annotations

import os
import signal
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

import pytest

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(variable, "1")

if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

SLOW = Path(__file__).with_name("slow_tests.txt")
MOST, MOST_OF_ALL_CASES = 0.4, 2.0  # seconds of the processor


def without_parameters(item: pytest.Item) -> str:
    return item.nodeid.partition("[")[0]


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--record-slow", action="store_true", help=f"write what is slow into {SLOW.name}")


def pytest_configure(config: pytest.Config) -> None:
    if config.getoption("--record-slow"):
        config.pluginmanager.register(Recorder())


@pytest.hookimpl(tryfirst=True)  # before -m chooses
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    slow = set(SLOW.read_text().split())
    for item in items:
        if without_parameters(item) in slow:
            item.add_marker("slow")


class Recorder:
    """Measures the tests of a run, with the fixtures that each of them makes. Names of others stay in the list."""

    def __init__(self) -> None:
        self.seconds: dict[str, list[float]] = defaultdict(list)

    @pytest.hookimpl(hookwrapper=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> Iterator[None]:
        begin = sum(os.times()[:4])  # of this process and of those that it has waited for
        yield
        self.seconds[without_parameters(item)].append(sum(os.times()[:4]) - begin)

    def pytest_sessionfinish(self) -> None:
        kept = set(SLOW.read_text().split()) - self.seconds.keys()
        slow = {name for name, s in self.seconds.items() if max(s) > MOST or sum(s) > MOST_OF_ALL_CASES}
        SLOW.write_text("\n".join(sorted(kept | slow)) + "\n")
