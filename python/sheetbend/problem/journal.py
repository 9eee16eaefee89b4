"""A journal of evaluations: what a fit has computed outlives its process.

Every number of a fit follows from evaluations, which are pure: the same compiled problem at the same point gives the
same bits. So no optimizer's state is saved. A fit that goes on after a kill runs its whole program again, reads each
evaluation that the journal has, and so walks the same path to the same bits. The journal also remembers the seconds
that an evaluation took, since optimizers decide by them whether to make a Jacobian along with the residuals.

Where driven markers are corrected (`driven_sigma`), an evaluation also depends on where the last one ended. That state
is then a part of the key, and the state behind the evaluation a part of the value.
"""

from __future__ import annotations

import hashlib
import shutil
import sqlite3
import threading
import time
import warnings
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager
from contextvars import ContextVar, Token
from functools import wraps
from pathlib import Path
from types import TracebackType
from typing import ParamSpec, Protocol, Self, TypeVar

import numpy as np

from ..errors import InputError
from . import digests
from .journal_values import pack, seal, unpack, unseal

COMMIT_SECONDS = 0.1  # at least, between commits: what a kill may cost besides the evaluation under way
SHARE, GRACE = 0.02, 0.05  # of the time of evaluations, and s, that writing may take; what is beyond is made again
LARGEST_JACOBIAN = 64e6  # bytes; a larger one is made again
ROOM = 1e9  # bytes, of all values; when it is full no more Jacobians are kept, and no more residuals at twice as much
NAMED = 10  # of what differs from what a journal was begun with
RESERVE = 30e6  # bytes of the disk that are left to the results
TABLES = (
    "about (part TEXT, label TEXT, text TEXT NOT NULL, PRIMARY KEY (part, label))",
    "evaluation (key BLOB PRIMARY KEY, residuals BLOB NOT NULL, seconds REAL, jacobian BLOB, jacobian_seconds REAL, "
    "state BLOB)",
)

FAULTS = (sqlite3.Error, UnicodeError)  # the second where SQLite tells of bytes that are no text

Evaluation = tuple[bool, np.ndarray, np.ndarray]  # ok, residuals (rows,), Jacobian (rows, free) or (0, free)
Timed = tuple[Evaluation, float | None]  # with the seconds that it took when it was made, where they are known
_current: ContextVar[Journal | None] = ContextVar("journal", default=None)


def current() -> Journal | None:
    """The journal that evaluations are read from and written to here, if one is open (`with Journal(path):`)."""
    return _current.get()


def leave() -> None:
    """Let problems that are made from now on go without the journal: a fit that goes on will not come to them."""
    _current.set(None)


class Journal(AbstractContextManager["Journal"]):
    """A file of evaluations, in use for all problems that are made inside its context.

    Attributes:
        path: the file.
        read, made: how many evaluations were read from it, and how many were made.
        trouble: why it is used no longer, as when the disk is full; empty as long as it is.
    """

    def __init__(
        self, path: str | Path, about: Mapping[str, str] | None = None, say: Callable[[str], None] | None = None
    ) -> None:
        """Open a journal, or begin one where there is no file.

        Args:
            path: of the file, on a local disk if there is one.
            about: labels and texts of what the fit is made from. They are compared with those that the journal was
                begun with, as are the versions of the software, the machine, and the first problem that is evaluated.
            say: called with `trouble`, or where the disk has no room left to write; issues a RuntimeWarning by default.

        Raises:
            InputError: the file is of another fit (the message says what differs), is no journal, is in use, or cannot
                be written.
        """
        self.path = Path(path)
        self.read = self.made = 0
        self.trouble = ""
        self._say = say or (lambda text: warnings.warn(text, RuntimeWarning, stacklevel=2))
        self._lock = threading.RLock()
        self._committed = time.monotonic()
        self._writing = True
        self._worked = self._spent = 0.0  # s, in evaluations, and in keeping them
        self._problem_known, self._finished = False, False
        self._token: Token[Journal | None] | None = None
        try:
            self._db = sqlite3.connect(self.path, isolation_level=None, check_same_thread=False, timeout=0.0)
            try:
                # Exclusive: a second process is refused, and no memory is shared, which network disks cannot do.
                self._db.executescript(
                    "PRAGMA trusted_schema = OFF; PRAGMA locking_mode = EXCLUSIVE; PRAGMA journal_mode = WAL; "
                    "PRAGMA synchronous = NORMAL;" + "".join(f"CREATE TABLE IF NOT EXISTS {t};" for t in TABLES)
                )
                self._db.execute("BEGIN IMMEDIATE")
                made = self._db.execute("SELECT sql FROM sqlite_master WHERE sql IS NOT NULL ORDER BY sql").fetchall()
                if made != [(f"CREATE TABLE {t}",) for t in TABLES]:
                    raise sqlite3.DatabaseError("it has other tables than a journal")
                self._expect("fit", {**digests.of_software(), **(about or {})})
                kept = self._db.execute("SELECT key, jacobian IS NOT NULL FROM evaluation").fetchall()
                sizes = "coalesce(sum(length(residuals) + length(state) + coalesce(length(jacobian), 0)), 0)"
                self._size: int = self._db.execute(f"SELECT {sizes} FROM evaluation").fetchone()[0]
                self._db.execute("COMMIT")
            except BaseException:
                self._db.close()
                raise
        except FAULTS as error:
            fix = "give a file that can be written and that no other process uses, or remove it"
            raise InputError("journal", f"cannot be used: {error}", str(self.path), fix) from error
        self._known: dict[bytes, bool] = {key: bool(jacobian) for key, jacobian in kept}  # whether with a Jacobian

    def __len__(self) -> int:
        """How many evaluations it holds."""
        return len(self._known)

    def __enter__(self) -> Self:
        self._token = _current.set(self)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._token is not None:
            _current.reset(self._token)
        self.close()

    def finish(self) -> None:
        """The fit is done and its result is safe: closing removes the file."""
        self._finished = True

    def close(self) -> None:
        """Write what is left, or remove the file of a finished fit."""
        with self._lock:
            try:
                if self._db.in_transaction and not self._finished and not self.trouble:
                    self._db.execute("COMMIT")
            except FAULTS as error:
                self._stop(error)
            finally:
                self._db.close()
        if self._finished:
            remove(self.path)

    def problem(self, made_from: Mapping[str, str]) -> bytes:
        """The key of a compiled problem, from digests of what it is made from. The first problem of a fit that goes on
        must be the one that the journal was begun with.

        Raises:
            InputError: it is not; the message names what differs.
        """
        with self._lock:
            if not self._problem_known and not self.trouble:
                try:
                    self._expect("problem", made_from)
                except FAULTS as error:
                    self._stop(error)
                self._problem_known = True
        return digests.digest(made_from).encode()

    def evaluate(
        self,
        problem: bytes,
        u: np.ndarray,
        jacobian: bool,
        make: Callable[[], Evaluation],
        state: Callable[[], bytes] = bytes,
    ) -> tuple[Evaluation, float | None, bytes | None]:
        """The evaluation of a problem at u (free,): as it was kept, or made now and kept. One that is not ok is not
        kept: to make it again is quick, as it ends where the motion diverges. Nor are all of those that take little
        longer than to write them.

        Returns:
            The evaluation, the seconds that it took when it was made, where they are known, and where it was kept the
            `state` behind it.
        """
        point = np.ascontiguousarray(u, dtype=float)
        key = hashlib.blake2b(problem + point.tobytes(), digest_size=16).digest()
        if not self.trouble and (self._known.get(key, False) or (not jacobian and key in self._known)):
            kept = self._kept(key, jacobian, len(point))
            if kept is not None:
                self.read += 1
                return kept
        began = time.perf_counter()
        found = make()
        seconds = time.perf_counter() - began
        self.made += 1
        self._worked += seconds
        if found[0] and self._writing and self._spent <= GRACE + SHARE * self._worked:
            began = time.thread_time()
            self._keep(key, found, jacobian, seconds, state())
            self._spent += time.thread_time() - began
        return found, seconds, None

    def _kept(self, key: bytes, jacobian: bool, free: int) -> tuple[Evaluation, float | None, bytes] | None:
        columns = "residuals, jacobian, jacobian_seconds" if jacobian else "residuals, NULL, seconds"
        with self._lock:
            try:
                row = self._db.execute(f"SELECT {columns}, state FROM evaluation WHERE key = ?", (key,)).fetchone()
            except FAULTS as error:
                self._stop(error)
                return None
        try:
            r, packed, seconds, state = row
            residuals = np.frombuffer(unseal(key, r)).copy()
            J = unpack(unseal(key, packed), len(residuals), free) if jacobian else np.zeros((0, free))
            return (True, residuals, J), None if seconds is None else float(seconds), unseal(key, state)
        except (TypeError, ValueError):  # damaged: it is made again
            self._known.pop(key, None)  # another thread may have found it too
            return None

    def _keep(self, key: bytes, found: Evaluation, jacobian: bool, seconds: float, state: bytes) -> None:
        residuals = seal(key, found[1].tobytes())
        packed = seal(key, pack(found[2])) if jacobian else None
        if packed is not None and (len(packed) > LARGEST_JACOBIAN or self._size + len(packed) > ROOM):
            packed = None
        state = seal(key, state)
        more = len(packed or b"") + (0 if key in self._known else len(residuals) + len(state))
        if (key in self._known and packed is None) or self._size + more > 2 * ROOM:
            return
        with self._lock:
            try:
                if shutil.disk_usage(self.path.parent).free < RESERVE:
                    self._writing = False
                    left = f"less than {RESERVE / 1e6:g} MB are left on its disk"
                    self._say(f"the journal {self.path} is no longer written: {left}")
                    return
                if not self._db.in_transaction:
                    self._db.execute("BEGIN IMMEDIATE")
                if key in self._known:
                    update = "UPDATE evaluation SET jacobian = ?, jacobian_seconds = ? WHERE key = ?"
                    self._db.execute(update, (packed, seconds, key))
                else:
                    took = (None, seconds) if jacobian else (seconds, None)
                    row = (key, residuals, took[0], packed, took[1], state)
                    self._db.execute("INSERT OR REPLACE INTO evaluation VALUES (?, ?, ?, ?, ?, ?)", row)
                self._size += more
                self._known[key] = packed is not None
                if time.monotonic() - self._committed >= COMMIT_SECONDS:
                    self._db.execute("COMMIT")
                    self._committed = time.monotonic()
            except (*FAULTS, OSError) as error:
                self._stop(error)

    def _expect(self, part: str, texts: Mapping[str, str]) -> None:
        """Compare with what the journal was begun with, or note it in one that has just begun."""
        had = dict(self._db.execute("SELECT label, text FROM about WHERE part = ?", (part,)).fetchall())
        if not had:
            rows = [(part, label, text) for label, text in texts.items()]
            self._db.executemany("INSERT INTO about VALUES (?, ?, ?)", rows)
        differ = [label for label in {**had, **texts} if had and had.get(label) != texts.get(label)]
        if differ:
            changes = [f"{x} ({had.get(x, 'none')} then, {texts.get(x, 'none')} now)" for x in differ[:NAMED]]
            if len(differ) > NAMED:
                changes.append(f"and {len(differ) - NAMED} more")
            fix = "run it with what it was begun with, or begin anew without it"
            raise InputError("journal", f"is of another fit; different are {', '.join(changes)}", str(self.path), fix)

    def _stop(self, error: Exception) -> None:
        """A journal that cannot be used is given up; the fit is not."""
        self._writing = False
        self.trouble = f"the journal {self.path} is no longer used ({error}); the fit continues without it"
        self._say(self.trouble)


class Interruptible(Protocol):
    """A result that knows whether it is one of a finished work."""

    @property
    def interrupted(self) -> bool: ...


P = ParamSpec("P")
R = TypeVar("R", bound=Interruptible)


def journaled(work: Callable[P, R]) -> Callable[P, R]:
    """Gives a function's argument `journal`, a path or None, its meaning: all that it evaluates goes through that
    journal, which is removed when the function returns a result that was not interrupted."""

    @wraps(work)
    def run(*args: P.args, **options: P.kwargs) -> R:
        path = options.get("journal")
        if path is None:
            return work(*args, **options)
        if not isinstance(path, str | Path):
            raise InputError("journal", "is not a path", path, "give a file's path, or None")
        with Journal(path) as journal:
            found = work(*args, **options)
            if not found.interrupted:
                journal.finish()
            return found

    return run


def remove(path: Path) -> None:
    """Remove a journal, and what SQLite may have left beside it after a kill."""
    for end in ("", "-wal", "-shm"):
        path.with_name(path.name + end).unlink(missing_ok=True)
