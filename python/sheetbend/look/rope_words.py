"""The sentences in a draft of a rope: what the recording shows, and what is not known."""

from __future__ import annotations

from ..quantities.wording import short
from .held import Held
from .lying import RADIUS
from .marked import said_of
from .rope_model import ROUND, UNSEEN, RopeModel
from .text import joined

TWIST = (
    "the torsional stiffness and its damping: a motion hardly shows them. They follow the bending stiffness, times "
    f"{ROUND}, and its damping, as in a solid round section"
)
WITHOUT_TWIST = (
    "its twist: the rope turns in space, where [[scene.rope]] damps a bend that turns, too, so rope_bend_damping comes "
    "out too small, by a fifth in one example. A [[scene.rod]] does not; write one where the damping matters"
)
SPIN = (
    "whether the hand lets the rope spin about its own axis, as a swivel does. It is taken not to (`hold_roll`): where "
    "a bend goes round, every section then bends back and forth, which damps. One that spins with its bend "
    "is damped less, and the damping would come out too small, by a fifth in one example. If it can spin, remove "
    "`hold_roll`"
)
UNLOADED = (
    "the shape that the rope has without load. Shapes at rest under its weight hardly tell it from the stiffness, "
    "which is fitted beside four modes of a rest curvature. If the rope is straight without load, remove `set_modes` "
    "and [parameters.rope_set_...]"
)
LOAD = (
    "how the mass at the free end is attached: it is a point at the last marker, which turns freely. If you "
    "weighed it, give --weight"
)
WEIGHED = "how the weight at the free end is attached: it is a point at the last marker, which turns freely"
STIFF = (
    "whether something hangs at the free end. The model has nothing there; if a weight does, give its mass in kg with "
    "--weight"
)


ON_TABLE = (
    f"the radius of the rope: {1e3 * RADIUS:g} mm is taken. Only the height of the table plus the radius counts, and "
    "the markers show it",
    "the friction apart from the drag, if all slides at one speed: drag it slowly and fast. If nothing slides, the "
    "motion shows only the least friction (docs/tutorials/dragged_rope.md)",
    "the damping of bending: friction hides it, so the model has none",
    "whether the table is level. It is taken to be; a tilt of 1 degree changes the friction by up to 10 %",
)


def notes_of(rope: RopeModel) -> list[str]:
    """What is seen."""
    through, s = joined(rope.markers), rope.seen
    far = f"{min(rope.marked[0].arcs[-1], rope.length.value):.4g} m"
    said = [
        f"a rope through {through}, {far} from the first to the last"
        if s.static
        else f"a rope through {through}; {far} of it are free"
    ]
    if rope.table is not None:
        height = short(rope.table.height)
        said.append(
            f"it lies at one height, {height} m, as on a table: the table is a plane, and its friction is fitted"
        )
    if rope.stretch is not None:
        said.append(
            f"it stretches: it is up to {100.0 * rope.stretch.by:.2g} % longer than at other times. EA is fitted"
        )
    said += rope.start.said
    if rope.load is not None and rope.load.within == UNSEEN:
        said.append("its weight alone would hardly stretch it: its free end is taken to carry a mass, which is fitted")
    elif rope.load is not None:
        meters = f"{rope.load.meters:.2g}"
        counted = f"{short(rope.load.mass)} kg, as given" if rope.load.weighed else "it is fitted"
        said.append(f"its free end carries a mass, some {meters} times that of 1 m of the rope: {counted}")
    return [*said, *said_of(rope.marked)[0], *rope.held.notes]


def unknown_of(rope: RopeModel) -> list[str]:
    """What is not known, and what stands in its place."""
    said = [rope.length.said, rope.density.said, *rope.held.unknown]
    if rope.flat is not None:
        said.append(UNLOADED)
    if rope.held.alone:
        said.append(_true_motion(rope.held, rope.estimated))
    if rope.in_space:
        said.append(TWIST if rope.rod else WITHOUT_TWIST)
    if rope.keeps_roll:
        said.append(SPIN)
    if rope.table is not None:
        said += ON_TABLE
    if rope.load is not None:
        said.append(WEIGHED if rope.load.weighed else LOAD)
    elif rope.hangs_unknown:
        said.append(STIFF)
    return said + said_of(rope.marked)[1]


def _true_motion(found: Held, estimated: bool) -> str:
    what = f"the true motion of {joined(found.alone)}: its noise shakes the rope, which looks like damping. "
    if estimated:
        return what + (
            "The fit estimates it (`driven_sigma`), which takes minutes. `smoothing = 0.12` in the grip instead of "
            "`driven_sigma` in [[recording]] takes an eighth of the time, and the damping is known half as well"
        )
    return what + (
        "It is smoothed; `smoothing = 0` with `driven_sigma` in [[recording]] estimates it, which takes longer"
    )
