"""One thread per test process, since numerical libraries would otherwise start a pool each; and Ctrl-C works in tests
even where they are started in the background, where shells have it ignored."""

import os
import signal
from collections.abc import Callable

import pytest

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(variable, "1")

if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture
def intervals_alone(monkeypatch: pytest.MonkeyPatch) -> Callable[[], None]:
    """When called, fits of the test end with their intervals: what else speaks against a minimum is asked after these,
    and moves none (test_identification.py). For tests of many draws, whose first is fitted whole."""

    def begin() -> None:
        from sheetbend.fitting import conclusion

        monkeypatch.setattr(conclusion, "_doubts", lambda *given: ((), {}))

    return begin
