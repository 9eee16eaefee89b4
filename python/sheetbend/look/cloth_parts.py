"""Which markers of a recording lie on cloths, by their distances and names, and which on what holds them."""

from __future__ import annotations

import numpy as np

from ..arrays.types import Array
from .held import gripping
from .seen import FEWEST_OF_SHEET, Seen
from .sheet import components, spacing

EVEN = 0.1  # of the spacing: how much the distances of neighbors in rows and columns vary
FEW = 0.2  # of the markers, that have no neighbor at the spacing of all others


def cloth_parts(s: Seen) -> tuple[dict[str, list[int]], list[int]]:
    """Markers of each cloth by its name, and the others.

    Markers that hang together are on one cloth. Where many names share a stem, such as towel_1, towel_2, ..., those of
    rare stems are on what holds the cloth. So are those whose names or whose file say it, and the few that have no
    neighbor at the spacing of all others.
    """
    stems = [name.rstrip("0123456789").rstrip("_-.: ") for name in s.recording.markers]
    common = {stem for stem in stems if stems.count(stem) >= FEWEST_OF_SHEET}
    held_by = gripping(s)
    left = [k for k, stem in enumerate(stems) if k not in held_by and (not common or stem in common)]
    left = _in_step(s.apart, left)
    sheets = _connected_sets(s.apart, left)
    cloths = {_name(stems, own, n, len(sheets)): own for n, own in enumerate(sheets)}
    on_cloth = {k for own in sheets for k in own}
    return cloths, [k for k in range(len(stems)) if k not in on_cloth]


def _in_step(apart: Array, among: list[int]) -> list[int]:
    """Those of markers that have neighbors at the spacing of the sheet; all of them where more than a few have none."""
    if len(among) < FEWEST_OF_SHEET:
        return among
    own = apart[np.ix_(among, among)]
    has = np.asarray(np.abs(own / spacing(own) - 1.0) < EVEN).any(axis=1)
    return [among[k] for k in np.flatnonzero(has)] if 1.0 - has.mean() < FEW else among


def _connected_sets(apart: Array, among: list[int]) -> list[list[int]]:
    """Sets of markers that hang together, each at its own spacing, the largest first."""
    if len(among) < FEWEST_OF_SHEET:
        return []
    found = [[among[k] for k in own] for own in components(apart[np.ix_(among, among)])]
    if len(found) == 1:
        return found
    return sorted((part for own in found for part in _connected_sets(apart, own)), key=len, reverse=True)


def _name(stems: list[str], own: list[int], number: int, count: int) -> str:
    """The stem of a cloth's markers where it is one of several and has a stem of its own, else a number."""
    if count == 1:
        return "cloth"
    stem = stems[own[0]]
    its = {k for k, other in enumerate(stems) if other == stem}
    return stem if its == set(own) and stem.isascii() and stem.isidentifier() else f"cloth_{number + 1}"
