"""The plain C++ loops of plain.cpp and plain_cloth.cpp: builds them with the machine's compiler and runs them."""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent


def compiler() -> str | None:
    return shutil.which("c++")


def build(folder: Path, *flags: str, name: str = "plain") -> Path:
    """The program, compiled into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    program = folder / name
    source = HERE / f"{name}.cpp"
    subprocess.run(["c++", "-std=c++20", "-O3", *flags, "-o", str(program), str(source)], check=True)
    return program


def run(program: Path, *arguments: object) -> dict[str, Any]:
    """What it prints."""
    command = [str(program), *map(str, arguments)]
    return json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
