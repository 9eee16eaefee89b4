"""sheetbend fit ropes/*.toml: a fit for each configuration, in its own folder; what is done is not done again."""

from __future__ import annotations

import glob
import io
from collections.abc import Callable
from concurrent.futures import Executor, Future
from contextlib import suppress
from pathlib import Path

from rich.console import Console

from ..config import GrippedConfig, parse_any
from ..config.file import content
from ..config.named_files import named_files
from ..errors import ConfigError, InputError, SheetbendError
from ..files.door import noting, reading
from ..files.whole import UnwrittenError, write_text
from ..problem.workers import naming_losses
from ..report.fit_result import FitResult
from .journals import NAME
from .outcome import Code, Outcome, code_of
from .screen import Screen

RESULT, ERROR = "fit.json", "error.txt"
WORST_FIRST = (Code.INTERRUPTED, Code.BAD_INPUT, Code.NOT_CONVERGED, Code.NOT_IDENTIFIABLE)
Single = Callable[[Console, Path, Path, bool], Outcome]


def fit_all(
    console: Console, patterns: list[str], output: Path, strict: bool, single: Single, executor: Executor | None
) -> Outcome:
    """Fit every configuration of some patterns, each into OUTPUT/NAME. The error of one that fails is printed and
    written to OUTPUT/NAME/error.txt, and the others go on.

    Args:
        single: fits one of them: (console, configuration, folder, strict) -> outcome.
        executor: does several at the same time; None for one after the other.

    Raises:
        ConfigError: a pattern names no configuration, or two have the same name.
    """
    tasks, unread = _tasks(patterns, output)
    made = {folder: _made(path, folder) for path, folder in tasks}
    left = [(path, folder) for path, folder in tasks if made[folder] is None]
    console.print(f"{len(tasks)} configurations, {len(tasks) - len(left)} of them done", soft_wrap=True)
    for path, folder in tasks:
        if folder != output / path.stem:  # where the error of a file without a name was
            (output / path.stem / ERROR).unlink(missing_ok=True)
    codes = {str(path): _failed(console, output / path.stem, error) for path, error in unread.items()}
    codes |= {folder.name: code_of([result], strict) for folder, result in made.items() if result is not None}
    futures: list[Future[tuple[str, Code]]] = []
    try:
        if executor is not None:
            futures = [executor.submit(_run_in_worker, single, path, folder, strict) for path, folder in left]
        for i, (path, folder) in enumerate(left):
            if executor is None:
                codes[folder.name] = _code_of(single, console, path, folder, strict)
            else:
                with naming_losses():
                    text, codes[folder.name] = futures[i].result()
                console.print(text, soft_wrap=True, end="")
            if codes[folder.name] is Code.INTERRUPTED:
                break
    except KeyboardInterrupt:  # while workers fit; what they have begun stays in journals
        pass
    finally:
        for future in futures:
            future.cancel()
    codes |= {folder.name: Code.INTERRUPTED for _, folder in left if folder.name not in codes}
    if Code.INTERRUPTED in codes.values():
        console.print("\ninterrupted: the same command continues from here", soft_wrap=True)
    failed = [name for name, code in codes.items() if code not in (Code.DONE, Code.INTERRUPTED)]
    if failed:
        console.print(f"\nnot done, not converged or not identifiable: {', '.join(failed)}", soft_wrap=True)
    console.print(f"\n`sheetbend collect {output}` puts them into one table", soft_wrap=True)
    worst = next((code for code in WORST_FIRST if code in codes.values()), Code.DONE)
    data = {"fits": {name: int(code) for name, code in codes.items()}, "output": str(output)}
    return Outcome(data, worst)


def _tasks(patterns: list[str], output: Path) -> tuple[list[tuple[Path, Path]], dict[Path, ConfigError]]:
    """Configurations in the order of their names, with their folders, and what is wrong with files that are none."""
    paths: set[Path] = set()
    for pattern in patterns:
        found = {Path(name) for name in glob.glob(pattern, recursive=True)} | {Path(pattern)}
        if not (files := {path for path in found if path.is_file()}):
            fix = "give configurations, or a pattern of them such as 'ropes/*.toml'"
            raise ConfigError("config", "names no file", pattern, fix)
        paths |= files
    taken: dict[str, Path] = {}
    unread: dict[Path, ConfigError] = {}
    for path in sorted(paths):
        try:
            with reading(path, ConfigError):
                name = parse_any(path).experiment.name
        except ConfigError as error:
            unread[path] = error
            continue
        if name in taken:
            fix = f"give each a name of its own; {taken[name]} has it too"
            raise ConfigError(f"{path}: experiment.name", "is another one's", name, fix)
        taken[name] = path
    if not taken:
        raise next(iter(unread.values()))
    return [(path, output / name) for name, path in taken.items()], unread


def _made(path: Path, folder: Path) -> FitResult | None:
    """The result that is there, if it is newer than the configuration and the files that this names, and no journal is
    left."""
    result = folder / RESULT
    if not result.is_file() or (folder / NAME).exists():
        return None
    if isinstance(parse_any(path), GrippedConfig):
        return None
    files = [path, *(path.parent / table[key] for table, key in named_files(content(path)))]
    made = result.stat().st_mtime_ns
    if not all(file.is_file() and file.stat().st_mtime_ns < made for file in files):
        return None
    with suppress(InputError):  # another version's: fitted again
        return FitResult.load(result)
    return None


def _code_of(single: Single, console: Console, path: Path, folder: Path, strict: bool) -> Code:
    """The code of one fit; an error of the package is told."""
    try:
        with noting():
            code = single(console, path, folder, strict).code
    except SheetbendError as error:
        return _failed(console, folder, error, f"{path}: ")
    (folder / ERROR).unlink(missing_ok=True)
    return code


def _failed(console: Console, folder: Path, error: SheetbendError, ahead: str = "") -> Code:
    """Print an error, write it into the folder of the fit, and return its code."""
    console.print(f"{ahead}{error}", soft_wrap=True)
    with suppress(OSError, UnwrittenError):
        folder.mkdir(parents=True, exist_ok=True)
        write_text(folder / ERROR, f"{ahead}{error}\n")
    return Code.BAD_INPUT if isinstance(error, ConfigError) else Code.NOT_CONVERGED


def _run_in_worker(single: Single, path: Path, folder: Path, strict: bool) -> tuple[str, Code]:
    """Run one fit in a worker; return what it printed and its exit code."""
    console = Screen()
    console.file = io.StringIO()
    code = _code_of(single, console, path, folder, strict)
    return console.file.getvalue(), code
