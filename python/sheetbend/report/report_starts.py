"""What a report tells of a fit's starts."""

from __future__ import annotations

from ..quantities.wording import short
from ..result.result import FitData, Start
from .tables import Section

_SAME_MINIMUM = 0.01  # starts that end within 1 % of the best cost found the same minimum
_COLUMNS = 4  # parameters that the table of groups shows
_GROUPS = 10  # that it shows


def starts_note(result: FitData) -> list[tuple[str, str]]:
    """How many of several starts ended at the best cost, as a note; none of a single start."""
    if len(result.starts) < 2:
        return []
    costs = [start.cost for start in result.starts if start.cost is not None]
    if not costs:
        return [("starts", f"all {len(result.starts)} diverged")]
    same = sum(cost <= min(costs) * (1 + _SAME_MINIMUM) for cost in costs)
    words = f"{same} of {len(result.starts)} ended within 1 % of the best cost; the worst at {max(costs):.4g}"
    if len(costs) < len(result.starts):
        words += f"; {len(result.starts) - len(costs)} diverged"
    return [("starts", words)]


def groups_of_starts(result: FitData) -> Section:
    """The groups of raced starts, that with the lowest cost first: a waterfall with one step for each minimum."""
    groups: dict[int, list[Start]] = {}
    for start in result.starts:
        if start.group is not None:
            groups.setdefault(start.group, []).append(start)
    names = [e.name for e in result.estimates][:_COLUMNS]
    rows = []
    for group in list(groups.values())[:_GROUPS]:
        raced = [start.raced for start in group if start.raced is not None]
        cost = "diverged" if group[0].cost is None else short(group[0].cost, 6)
        values = [short(group[0].values[name]) if name in group[0].values else "" for name in names]
        ends = (short(min(raced), 6), short(max(raced), 6)) if raced else ("", "")
        rows.append((str(len(group)), cost, *ends, *values))
    headers = ("starts", "cost of its fit", "raced to", "at most", *names)
    notes = []
    if groups:
        words = "cost at the end of the last window. Starts whose ends that window hardly tells apart form a group; "
        notes.append(("raced to", words + "the best of each group is fitted to the whole motion"))
    if len(groups) > _GROUPS:
        notes.append(("not listed", f"{len(groups) - _GROUPS} groups with higher costs; fit.json has all starts"))
    lost = [start for start in result.starts if start.cost is None and start.group is None and start.first]
    if lost:
        notes.append(("failed", f"{len(lost)} of {len(result.starts)}: the motion diverges from there"))
    return Section("Groups of starts", headers if rows else (), tuple(rows), tuple(notes))
