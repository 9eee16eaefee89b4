"""When ./run and ./test install anew (tools/setup.sh)."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PIP = "#!/usr/bin/env bash\nprintf '%s\\n' \"$*\" >>pip.log\n"  # notes what it is asked and does nothing
INSTALL = 'set -euo pipefail; ROOT=$PWD; source "$1"; PATH=$PWD/.venv/bin:$PATH; install_sheetbend "$2"'


@pytest.fixture
def checkout(tmp_path: Path) -> Path:
    for name in ("licenses", "cmake", "core", "adjoint", "python", ".venv/bin"):
        (tmp_path / name).mkdir(parents=True)
    for name in ("CMakeLists.txt", "LICENSE"):
        (tmp_path / name).touch()
    (tmp_path / "pyproject.toml").write_text("[build-system]\nrequires = ['ninja']\n")
    (tmp_path / ".venv/bin/python").symlink_to(sys.executable)
    (tmp_path / ".venv/bin/pip").write_text(PIP)
    (tmp_path / ".venv/bin/pip").chmod(0o755)
    return tmp_path


def install(checkout: Path, extras: str, kernels: str | None = None) -> str | None:
    """Which kernels were compiled; nothing where what is installed serves."""
    log = checkout / "pip.log"
    log.unlink(missing_ok=True)
    environment = {"PATH": "/usr/local/bin:/usr/bin:/bin"} | ({"SHEETBEND_KERNELS": kernels} if kernels else {})
    command = ["bash", "-c", INSTALL, "install", str(ROOT / "tools/setup.sh"), extras]
    done = subprocess.run(command, cwd=checkout, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert ("up to date" in done.stdout) == (not log.exists())
    return log.read_text().split("SHEETBEND_KERNELS=")[1].split()[0] if log.exists() else None


def test_what_is_installed_serves_only_what_it_was_compiled_for(checkout: Path) -> None:
    assert install(checkout, "fit") == "machine"
    assert install(checkout, "fit") is None
    assert install(checkout, "fit", "machine") is None
    assert install(checkout, "fit", "all") == "all"
    assert install(checkout, "fit") is None  # this machine's are among them
    assert install(checkout, "fit", "portable") == "portable"  # for who wants those alone
    assert install(checkout, "fit") == "machine"
    assert install(checkout, "dev", "portable") == "all"  # tests compare them
    assert install(checkout, "fit") is None
    assert install(checkout, "plot", "all") is None


def test_a_changed_source_is_installed(checkout: Path) -> None:
    install(checkout, "fit")
    (checkout / "core/a.cpp").touch()
    assert install(checkout, "fit") == "machine"
