"""`sheetbend fit --dask`, and the jobs for SLURM in docs/cluster.md."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import sheetbend as sb
from commands import run
from sheetbend.report.parameter_table import TABLE
from test_collect import ROPE

pytest.importorskip("distributed")


@pytest.fixture
def ropes(tmp_path: Path) -> Path:
    rng, times = np.random.default_rng(1), np.arange(20) / 50
    for name, EI in (("rope_01", 1.8e-3), ("rope_02", 2.2e-3)):
        x = sb.simulate(
            sb.rope(0.5, 6, density=0.05, EI=EI, clamp_start=(1, 0, 0)), times, sb.Solver(h=0.005)
        ).positions
        sb.Recording(x + 1e-4 * rng.standard_normal(x.shape), times, name=name).save(tmp_path / f"{name}.npz")
        (tmp_path / f"{name}.toml").write_text(ROPE.format(name=name), encoding="utf-8")
    both = ROPE.format(name="rope_01").replace('name = "rope_01"', 'name = "both"')
    (tmp_path / "both.toml").write_text(both + '\n[[recording]]\nfile = "rope_02.npz"\n', encoding="utf-8")
    return tmp_path


def scripts() -> list[str]:
    """The jobs in docs/cluster.md."""
    page = (Path(__file__).parents[2] / "docs/cluster.md").read_text(encoding="utf-8")
    return re.findall(r"```sh\n(#!/bin/bash\n.*?)```", page, re.DOTALL)


def test_the_jobs_of_the_documentation_write_the_tables_of_one_process(ropes: Path) -> None:
    """With srun that starts one process, and sheetbend as this Python has it."""
    tools = ropes / "tools"
    tools.mkdir()
    python = sys.executable
    (tools / "srun").write_text('#!/bin/bash\nshift\nexec "$@"\n')
    (tools / "sheetbend").write_text(f'#!/bin/bash\nexec {python} -m sheetbend "$@"\n')
    (tools / "dask").write_text(f'#!/bin/bash\nexec {python} -m dask "$@"\n')
    for tool in tools.iterdir():
        tool.chmod(0o755)
    (ropes / "ropes").mkdir()
    for file in ropes.glob("rope_01.*"):
        shutil.copy(file, ropes / "ropes")
    shutil.copy(ropes / "both.toml", ropes / "my.toml")
    array, cluster = scripts()
    given = {**os.environ, "PATH": f"{tools}:{os.environ['PATH']}", "SLURM_ARRAY_TASK_ID": "1", "SLURM_NTASKS": "2"}
    for job in (array, cluster):
        done = subprocess.run(["bash", "-c", job], cwd=ropes, env=given, capture_output=True, text=True, timeout=500)
        assert done.returncode in (0, 3, 4), done.stdout + done.stderr  # whatever the fit's verdict
    assert "tasks were shared out: per task" in done.stdout
    alone = run("fit", ropes / "my.toml", "--output", ropes / "alone" / "my")
    assert "shared out" not in alone.stdout
    run("fit", ropes / "ropes" / "rope_01.toml", "--output", ropes / "alone" / "rope_01")
    for name in ("my", "rope_01"):
        assert (ropes / "out" / name / TABLE).read_bytes() == (ropes / "alone" / name / TABLE).read_bytes()
