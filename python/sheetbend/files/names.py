"""Names that come from files and people and become names of files: checked once, where they enter."""

from __future__ import annotations

import unicodedata

from ..errors import RecordingError

LONGEST = 100
"""Bytes of UTF-8 in a name: two names, what stands between them and a suffix fit into the 255 of a file name."""

_DEVICES = {"con", "prn", "aux", "nul", *(f"{port}{k}" for port in ("com", "lpt") for k in range(1, 10))}
_STEERING = ("Cc", "Cs", "Zl", "Zp")  # control characters, halves of surrogate pairs, separators of lines
_TURNING = frozenset("\u061c\u200e\u200f\u202a\u202b\u202c\u202d\u202e\u2066\u2067\u2068\u2069")  # of the direction


def steering(text: str, allowed: str = "") -> str:
    """The first character of a text that steers a terminal or turns its direction instead of printing; "" without."""
    if text.isascii() and text.isprintable():
        return ""
    for c in text:
        if c not in allowed and (c in _TURNING or unicodedata.category(c) in _STEERING):
            return c
    return ""


def flaw(name: str) -> tuple[str, str] | None:
    """What keeps a text from being the name of a file in any folder, and the fix; None where nothing does."""
    if any(c in name for c in "/\\"):
        return "holds a separator of folders", "use a name without / and \\"
    if name != name.strip() or name[0] == "." or name[-1] == ".":
        return "starts or ends with a point or a blank", "use a name that starts and ends with a letter or a digit"
    if steering(name):
        return "holds a control character", "use letters, digits and marks that print"
    if len(name.encode()) > LONGEST:
        return f"is longer than {LONGEST} bytes of UTF-8", "use a shorter name"
    if name.partition(".")[0].strip().lower() in _DEVICES:
        return "is a name that some systems reserve for a device", "use another name, such as one with a number"
    return None


def checked_name(field: str, name: object) -> str:
    """Return the name if a file can have it: not empty, no path, nothing hidden, at most `LONGEST` bytes.

    Raises:
        RecordingError: it is no such text.
    """
    if not isinstance(name, str) or not name:
        raise RecordingError(field, "must be a non-empty string", name, "give a name")
    found = flaw(name)
    if found is not None:
        raise RecordingError(field, found[0], name, found[1])
    return name


def folded(name: str) -> str:
    """What two names share that are one file where case does not count, or where accents are composed."""
    return unicodedata.normalize("NFC", name).casefold()
