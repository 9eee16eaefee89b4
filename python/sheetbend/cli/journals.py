"""The journal of `sheetbend fit`: in the output folder, where `--resume` finds it, until all results are written."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import fields
from pathlib import Path

from ..config import Config, GrippedConfig
from ..errors import ConfigError, InputError
from ..problem.digests import digest
from ..problem.journal import Journal, remove
from ..recording.recording import Recording

NAME = "journal.sqlite"
OPTION = "--resume"
Say = Callable[[str], None]


def made_from(config: Config | GrippedConfig, recordings: Sequence[Recording]) -> dict[str, str]:
    """Digests of the sections of a configuration and of its recordings. What is drawn and the number of threads are
    left out: no number depends on them."""
    content = config.model_dump(mode="json", exclude={"output": True, "fit": {"threads"}})
    sections = {f"[{name}]": digest(section) for name, section in content.items()}
    contents = [{part.name: getattr(recording, part.name) for part in fields(recording)} for recording in recordings]
    return sections | {f"recording {i} '{c['name']}'": digest(c) for i, c in enumerate(contents)}


@contextmanager
def journal_in(folder: Path, about: Mapping[str, str], resume: bool, say: Say) -> Iterator[Journal | None]:
    """The journal in use; None where none can be, which costs no fit. `Journal.finish` removes it.

    Raises:
        ConfigError: it is to go on, but the journal is of something else, or cannot be read; or an earlier one cannot
            be removed.
    """
    path = folder / NAME
    begun = path.exists()
    if begun and not resume:
        try:
            remove(path)
        except OSError as error:
            fix = "move it away, or give another folder"
            raise ConfigError(
                "--output", f"has a {NAME} that cannot be removed: {error.strerror}", str(path), fix
            ) from error
        say(f"starts anew: the unfinished run in {folder} is discarded ({OPTION} would have continued it)")
    elif resume and not begun:
        say(f"nothing to resume in {folder}: the fit begins")
    try:
        journal = Journal(path, about, say)
    except InputError as error:
        if resume:
            fix = "run it with what it was begun with, or leave --resume out to begin anew"
            raise ConfigError(OPTION, f"cannot go on: the journal {error.problem}", error.got, fix) from error
        say(f"without a journal, a kill costs the whole fit: {error}")
        yield None
        return
    if begun and resume:
        say(f"continues with {path}: {len(journal)} evaluations")
    with journal:
        yield journal
