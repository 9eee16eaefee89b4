"""What an error of a told number is in words."""

from __future__ import annotations

from collections.abc import Sequence

from ..problem.problem import FitProblem
from ..quantities.wording import short
from .told import ASIDE, BESIDE, DRAFT, LARGER, LATER, SLOWER, Told
from .told_inputs import DEGREE, FARTHER, LOADS, MILLIMETER, SIZE, SPEED, UNNAMED


def words_of(one: Told, more: float, problem: FitProblem, group: Sequence[int]) -> str:
    """That a told number is off by `more`, in words."""
    if one.missing is not None:
        return one.missing(more)
    e = problem.experiments[one.experiment]
    of = f" of {e.name}" if len(group) > 1 and not one.shared else ""
    size = short(abs(100 * more), 2) + " %"
    sign = "more" if more > 0 else "less"
    axis = f"{'' if more > 0 else '-'}{one.label.rsplit(' ', 1)[-1]}"
    if one.label == SIZE:
        alike = ""
        if e.scene.boundary.following:  # its frame rate moves all that is measured, and has no direction of its own
            rate = f"{short(abs(50 * more), 2)} % too {'short' if more > 0 else 'long'}"
            alike = f" (times of the recording that are {rate} have the same effect: its frame rate)"
        return f"gravity were {size} {'larger' if more > 0 else 'smaller'}{alike}"
    if one.label == LATER and e.scene.boundary.driven:
        when = f"{short(1e3 * abs(more), 2)} ms {'early' if more > 0 else 'late'}"
        return f"the clock of the recording{of} were {when} against that of what drives the scene (time_offset)"
    if one.label == LATER:
        when = "earlier" if more > 0 else "later"
        return f"the motion{of} had begun {short(1e3 * abs(more), 2)} ms {when} than the scene does (start_time)"
    if one.label == SLOWER:
        return f"the times of the recording{of} were {size} too {'short' if more > 0 else 'long'} (its frame rate)"
    if one.label == FARTHER:
        return f"what drives the scene{of} moved {size} {'farther' if more > 0 else 'less far'}"
    if one.label == LOADS:
        return f"the loads{of} were {size} {'larger' if more > 0 else 'smaller'}"
    if one.label == SPEED:
        return f"the motion{of} had started {size} {'faster' if more > 0 else 'slower'}"
    if one.label in UNNAMED.values():
        return f"{one.label}{of} were {size} {sign}"
    if one.label == LARGER:
        return f"the recording{of} were {size} too {'small' if more < 0 else 'large'} (its scale)"
    if one.name == "gravity":
        alike = " (a draft has the same effect)" if e.scene.has_drag else ""
        return f"gravity were turned by {short(abs(more) / DEGREE, 2)} degrees {_way(one.label, more)}{alike}"
    if one.label.startswith(DRAFT):
        return f"the air moved at {short(abs(more), 2)} m/s along {axis}"
    if one.name == "clamp_direction":
        turned = f"turned by {short(abs(more) / DEGREE, 2)} degrees about {axis}"
        return f"the clamps{of} and everything attached to them were {turned}"
    if one.label.startswith(ASIDE):
        return f"what drives the scene{of} were {short(abs(more) / MILLIMETER, 2)} mm farther along {axis}"
    if one.label.startswith(BESIDE):
        off = short(abs(more) / MILLIMETER, 2)
        return f"all markers{of} stood {off} mm off the axis of the rope, at right angles to it and to {axis}"
    if one.name == "clamps":
        farther = f"{short(abs(more) / MILLIMETER, 2)} mm farther along {axis}"
        return f"the clamps{of} and everything attached to them stood {farther}"
    if one.name == "markers":
        who = f"marker {one.marker}" if one.marker else "all markers"
        along = f"axis {1 + int(one.label.rsplit(' ', 1)[-1])} of the cloth" if e.scene.cloths else "the material"
        how = "farther" if more > 0 else "less far"
        return f"{who}{of} sat {short(abs(more) / MILLIMETER, 2)} mm {how} along {along}"
    if one.relative:
        return f"{one.name} were {size} {sign}"
    return f"{one.name} were {short(abs(more), 2)} {one.unit} {sign}"


def _way(label: str, more: float) -> str:
    """Such as "toward -x"."""
    way = label.removeprefix("gravity ")
    return way if more > 0 else way.replace("toward ", "toward -")
