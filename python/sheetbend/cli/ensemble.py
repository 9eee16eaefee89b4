"""sheetbend fit 'ropes/*.toml': a fit for each configuration, in its own folder; what is done is not done again."""

from __future__ import annotations

import glob
import io
from collections.abc import Callable
from concurrent.futures import Executor, Future
from pathlib import Path

from rich.console import Console

from ..config import GrippedConfig, parse_any
from ..errors import ConfigError, SheetbendError
from ..files.door import noting, reading
from ..minimum.workers import naming_losses
from .journals import NAME
from .outcome import Code, Outcome
from .screen import Screen

RESULT = "fit.json"
WORST_FIRST = (Code.TERMINATED, Code.INTERRUPTED, Code.BAD_INPUT, Code.NOT_CONVERGED, Code.NOT_IDENTIFIABLE)
Single = Callable[[Console, Path, Path, bool], Outcome]


def fit_all(
    console: Console, pattern: str, output: Path, strict: bool, single: Single, executor: Executor | None
) -> Outcome:
    """Fit every configuration of a pattern, each into OUTPUT/NAME. One that fails is told, and the others go on.

    Args:
        single: fits one of them: (console, configuration, folder, strict) -> outcome.
        executor: does several at the same time; None for one after the other.

    Raises:
        ConfigError: the pattern names no configuration, one is none, or two have the same name.
    """
    tasks = _tasks(pattern, output)
    left = [(path, folder) for path, folder in tasks if not _done(path, folder)]
    console.print(f"{len(tasks)} configurations, {len(tasks) - len(left)} of them done", soft_wrap=True)
    codes: dict[str, Code] = {folder.name: Code.DONE for path, folder in tasks if (path, folder) not in left}
    futures: list[Future[tuple[str, Code]]] = []
    try:
        if executor is not None:
            futures = [executor.submit(_apart, single, path, folder, strict) for path, folder in left]
        for i, (path, folder) in enumerate(left):
            if executor is None:
                codes[folder.name] = _told(single, console, path, folder, strict)
            else:
                with naming_losses():
                    text, codes[folder.name] = futures[i].result()
                console.print(text, soft_wrap=True, end="")
            if codes[folder.name] in (Code.INTERRUPTED, Code.TERMINATED):
                break
    finally:
        for future in futures:
            future.cancel()
    failed = [name for name, code in codes.items() if code is not Code.DONE]
    if failed:
        console.print(f"\nnot done, not converged or not identifiable: {', '.join(failed)}", soft_wrap=True)
    console.print(f"\n`sheetbend collect {output}` puts them into one table", soft_wrap=True)
    worst = next((code for code in WORST_FIRST if code in codes.values()), Code.DONE)
    data = {"fits": {name: int(code) for name, code in codes.items()}, "output": str(output)}
    return Outcome(data, worst)


def _tasks(pattern: str, output: Path) -> list[tuple[Path, Path]]:
    """Configurations in the order of their names, and their folders."""
    paths = [Path(name) for name in sorted(glob.glob(pattern, recursive=True)) if Path(name).is_file()]
    if not paths:
        raise ConfigError(
            "config", "names no file", pattern, "give a pattern of configurations, such as 'ropes/*.toml'"
        )
    taken: dict[str, Path] = {}
    for path in paths:
        with reading(path, ConfigError):
            name = parse_any(path).experiment.name
        if name in taken:
            fix = f"give each a name of its own; {taken[name]} has it too"
            raise ConfigError(f"{path}: experiment.name", "is another one's", name, fix)
        taken[name] = path
    return [(path, output / name) for name, path in taken.items()]


def _done(path: Path, folder: Path) -> bool:
    """Whether a result is there that is newer than the configuration and its recordings, with no journal left."""
    result = folder / RESULT
    if not result.is_file() or (folder / NAME).exists():
        return False
    config = parse_any(path)
    if isinstance(config, GrippedConfig):
        return False
    named = [name for r in config.recording for name in (r.file, r.cloud) if name is not None]
    files = [path, *(path.parent / name for name in named)]
    made = result.stat().st_mtime_ns
    return all(file.is_file() and file.stat().st_mtime_ns < made for file in files)


def _told(single: Single, console: Console, path: Path, folder: Path, strict: bool) -> Code:
    """The code of one fit; an error of the package is printed."""
    try:
        with noting():
            return single(console, path, folder, strict).code
    except SheetbendError as error:
        console.print(f"{path}: {error}", soft_wrap=True)
        return Code.BAD_INPUT if isinstance(error, ConfigError) else Code.NOT_CONVERGED


def _apart(single: Single, path: Path, folder: Path, strict: bool) -> tuple[str, Code]:
    """Run one fit in a worker; return what it printed and its exit code."""
    console = Screen()
    console.file = io.StringIO()
    code = _told(single, console, path, folder, strict)
    return console.file.getvalue(), code
