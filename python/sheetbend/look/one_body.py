"""A body that turns on something, such as a door, a seat on ropes or a bar on a wire, as if it bent: no draft has
joints."""

from __future__ import annotations

import numpy as np

from ..arrays.rigid import FEWEST, rigid_motion
from ..errors import SceneError
from .seen import Seen, in_line

KEEPS = 2.5  # times the noise: root mean square distance of markers from the body that they are on; sqrt(3) is expected
MOVES = 20.0  # times this: how far they move at least. What hardly moves, hardly bends
WORDS = (
    "whether it bends at all: all markers that move keep their places on one rigid body. A slack rope or a hanging "
    "cloth may swing like that, and then shows hardly any stiffness. If it is rigid, as a door, a seat on ropes or a "
    "bar on a wire, write a configuration of a body on a joint, see docs/bodies.md; or give a pivot and one marker of "
    "it alone, as in --markers 'pivot,end', for a pendulum"
)


def rigid(s: Seen) -> bool:
    """Whether all that moves is one rigid body, which no line is."""
    r = s.recording
    moving = [k for k in range(len(r.markers)) if k not in s.still]
    if len(moving) < FEWEST or in_line(s.apart[np.ix_(moving, moving)]):
        return False
    x = r.positions[r.mask[:, moving].all(axis=1)][:, moving]
    allowed = KEEPS * max(s.noise, 1e-3 * float(s.apart[np.ix_(moving, moving)].max()))
    if not len(x) or np.sqrt(x.var(axis=0).sum(axis=1)).max() < MOVES * allowed:
        return False
    try:
        return rigid_motion(x)[2] <= allowed
    except SceneError:  # they move against each other
        return False
