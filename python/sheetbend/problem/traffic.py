"""What sharing out work costs: tasks, bytes, and the seconds of workers and of the process that feeds them."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass
class Traffic:
    """Tasks of a fit that workers did.

    Attributes:
        tasks: their number.
        sent, received: bytes of them all, without the envelopes of the executor.
        working: s of processor time, that workers took.
        own: s of processor time, that this process took to send tasks and to receive answers.
        warned: whether it was warned of unlike machines.
    """

    tasks: int = 0
    sent: int = 0
    received: int = 0
    working: float = 0.0
    own: float = 0.0
    warned: bool = False

    def add(self, received: int, seconds: float) -> None:
        """Counts an answer."""
        self.tasks += 1
        self.received += received
        self.working += seconds

    @property
    def fed(self) -> float:
        """How many workers this process could keep busy with such tasks, if the network were free."""
        return self.working / self.own if self.own > 0.0 else float("inf")

    def __str__(self) -> str:
        if not self.tasks:
            return "no tasks were shared out"
        n, fed = self.tasks, max(self.fed, 1.0)
        return (
            f"{n} tasks were shared out: per task {_seconds(self.working / n)} of a worker, "
            f"{_size(self.sent / n)} sent, {_size(self.received / n)} received, "
            f"{_seconds(self.own / n)} of this process, which can feed about {fed:.0f} workers"
        )


def _seconds(value: float) -> str:
    return f"{value:.2g} s" if value >= 1.0 else f"{1e3 * value:.2g} ms"


def _size(value: float) -> str:
    for unit in ("bytes", "kB", "MB"):
        if value < 1000.0:
            return f"{value:.3g} {unit}"
        value /= 1000.0
    return f"{value:.3g} GB"
