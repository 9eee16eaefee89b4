"""Names that an experiment uses exist: of markers in its recording, of quantities in its scene."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

from ..errors import InputError


def check_names(
    name: str,
    markers: Sequence[str],
    quantities: Collection[str],
    offsets: Mapping[str, Sequence[str | None]],
    time_offset: str | None,
) -> None:
    """Refuse offsets and clocks of what does not exist.

    Args:
        name: of the experiment.
        markers, quantities: that there are.
        offsets, time_offset: as of an `Experiment`.

    Raises:
        InputError: names the marker or the quantity, and those that there are.
    """
    for marker, wanted in offsets.items():
        if marker not in markers:
            raise InputError(f"{name}.offsets", "name no marker", marker, f"use some of: {', '.join(markers)}")
        unknown = [one for one in wanted if one is not None and one not in quantities]
        if unknown or len(wanted) != 3:
            fix = f"give three, each None or one of: {', '.join(quantities)}"
            raise InputError(f"{name}.offsets", f"of '{marker}' are not three quantities of the scene", wanted, fix)
    if time_offset is not None and time_offset not in quantities:
        fix = f"use one of: {', '.join(quantities)}"
        raise InputError(f"{name}.time_offset", "names no quantity of the scene", time_offset, fix)
