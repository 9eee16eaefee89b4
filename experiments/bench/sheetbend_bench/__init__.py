"""Benchmarks: workloads that other simulators can be given too, and what they cost here (`measure.py`)."""

from .measurement import measure
from .workloads import WORKLOADS, Workload, workload

__all__ = ["WORKLOADS", "Workload", "measure", "workload"]
