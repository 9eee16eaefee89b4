"""The plain C++ loop of plain.cpp: builds it with the machine's compiler and runs it."""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path
from typing import Any

SOURCE = Path(__file__).with_name("plain.cpp")


def compiler() -> str | None:
    return shutil.which("c++")


def build(folder: Path, *flags: str) -> Path:
    """The program, compiled into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    program = folder / "plain"
    subprocess.run(["c++", "-std=c++20", "-O3", *flags, "-o", str(program), str(SOURCE)], check=True)
    return program


def run(program: Path, *arguments: object) -> dict[str, Any]:
    """What it prints."""
    command = [str(program), *map(str, arguments)]
    return json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
