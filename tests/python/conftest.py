"""Fixtures of several files."""

from collections.abc import Callable

import pytest


@pytest.fixture
def intervals_alone(monkeypatch: pytest.MonkeyPatch) -> Callable[[], None]:
    """When called, fits of the test end with their intervals: what else speaks against a minimum is asked after these,
    and moves none (test_identification.py). For tests of many draws, whose first is fitted whole."""

    def begin() -> None:
        from sheetbend.fitting import conclusion

        monkeypatch.setattr(conclusion, "_doubts", lambda *given: ((), {}))

    return begin
