"""What a draft of cloths says: what is seen of them, and what is not known."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .cloth_sheet import Sheet
from .seen import Seen
from .sheet import spacing
from .take import Measured
from .text import joined


def lies_over(names: Sequence[str], own: Sequence[int], because: str) -> str:
    return (
        f"what {joined(names[k] for k in own)} lie over: {because}, and no marker shows how the fabric runs there. "
        "They are left out; write this cloth by hand, as experiments/twin_cloth does"
    )


def seen_of(s: Seen, sheet: Sheet, several: bool) -> list[str]:
    names, held = s.recording.markers, []
    apart = spacing(s.apart[np.ix_(sheet.own, sheet.own)])
    whose = f"{sheet.name}: " if several else ""
    notes = [
        f"{whose}{len(sheet.own)} markers lie on a sheet, some {1e3 * apart:.3g} mm apart: a cloth of "
        f"{sheet.width:.3g} x {sheet.height:.3g} m with half of that beyond the outer ones where nothing holds it"
    ]
    for hold in sheet.held:
        of = joined(names[k] for k in hold.markers)
        what = f"single vertices of the {hold.side} edge" if hold.corners else f"the whole {hold.side} edge"
        if not hold.own:
            how = "moves" if hold.moves else "stays in place"
            held.append(f"on what holds {what} and {how}: {of}")
        elif hold.corners:
            how = "move" if hold.moves else "hardly move"
            held.append(f"{of} {how}, and the {hold.side} row of markers sags between them: the cloth is held there")
        else:
            how = (
                "moves: it is taken as what holds the cloth"
                if hold.tool is None
                else "moves: a tool holds the edge above it"
            )
            if not hold.moves:
                how = "hardly moves: the edge beyond it is taken as held"
            row = {"top": "upper", "bottom": "lower"}.get(hold.side, hold.side)
            held.append(f"the {row} row of markers, {of}, {how}")
    if sheet.slung:
        held.append("its middle hangs below its left and right edge: it is slung between them")
    if sheet.slack is not None:
        held.append(
            f"its length changes with its sag as that of a fabric of {sheet.slack.length:.4g} m without tension, from "
            f"the first to the last row, and {sheet.slack.first:.4g} m in the first frame"
        )
    if sheet.wind is not None:
        held.append("it hangs at a slant and hardly moves: a wind blows, or another axis points up")
    return notes + [whose + words for words in held]


def unknown_of(s: Seen, sheets: Sequence[Sheet], measured: Measured) -> list[str]:
    held = [hold for sheet in sheets for hold in sheet.held]
    windy = any(sheet.wind is not None for sheet in sheets)
    said = []
    if any(hold.own and not hold.corners for hold in held):
        said.append(
            "what holds the cloth: whole edges are taken. Change the set, or give a grip with the holder's markers"
        )
    if any(hold.corners for hold in held):
        said.append(
            "how large a patch is held at each corner: one vertex of the mesh is taken, and a cloth that is held at "
            "single vertices comes out too soft. Measure the patches, and give each set a box (`lower`, `upper`)"
        )
    said.append(
        "the size of the flat fabric: distances are taken as it hangs, stretched by its weight and the air. If that is "
        "1 %, the lowest markers are off by 1 % of the height, and the fitted tension is too stiff. Measure the edges "
        "and the markers on the flat cloth, and which way its warp runs, and correct mesh, origin and markers"
    )
    if windy:
        said.append(
            "how much the cloth is stretched: its flat size along warp and weft is fitted beside the tension, with a "
            "prior of 1 % about what the markers show. Give the sd of your own measurement where you have one"
        )
        said.append(
            "the stiffness in tension at the start: warp and shear begin at a guess, and the wind's pull shows them"
        )
    elif any(sheet.slung for sheet in sheets):
        said.append(
            "the stiffness across, in shear and in bending: a slung cloth shows that along its length, which is fitted "
            "as `..._warp`, whichever way the threads run. It is only as good as the length of the flat fabric, which "
            "is fitted beside it: an error of 0.2 % is one of 15 to 40 % of the stiffness"
        )
    if not windy and not all(sheet.slung for sheet in sheets):
        said.append("the stiffness in tension: a hanging cloth hardly shows it. warp and shear are not fitted")
    said.append(
        "how strongly the air acts at the start: `air_normal` begins with the value of a plate; a steady wind "
        "shows it only together with the wind's speed"
        if windy
        else "the wind: the air is taken to stand still, and `air_tangential`, its friction along the cloth, is a guess"
    )
    said.append(
        "the density: 0.2 kg/m^2 is assumed, and all other values are proportional to it. The intervals allow for 50 % "
        "of it (`[given]`): measure it, and give --density"
        if measured.density is None
        else "the mass of the markers"
    )
    if any(hold.moves and hold.own and hold.tool is None for hold in held):
        rows = "the upper row's noise" if len(held) == 1 and held[0].side == "top" else "their noise"
        said.append(
            f"the true motion of the holder: {rows}, {1e3 * s.noise:.2g} mm in each coordinate, shakes "
            "the cloth, and the prediction is worse for it. Give the holder's own markers, or a robot's "
            'poses with --poses; or add `driven_sigma = "estimate"` to [[recording]], which takes many times as long'
        )
    return said
