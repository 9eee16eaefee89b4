"""What a draft of cloths says: what is seen of them, and what is not known."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .cloth_held import Hold, share
from .cloth_sheet import Sheet
from .margin import HALF
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
    beyond = share(sheet.held)
    ends = (
        f"with {1e3 * max(sheet.margin):.3g} mm beyond the outer ones, as given"
        if sheet.margin is not None
        else (
            f"with {beyond:.2g} of that beyond the outer ones where nothing holds it"
            if beyond
            else "up to the outer ones"
        )
    )
    notes = [
        f"{whose}{len(sheet.own)} markers lie on a sheet, some {1e3 * apart:.3g} mm apart: a cloth of "
        f"{sheet.width:.3g} x {sheet.height:.3g} m {ends}"
    ]
    for hold in sheet.held:
        of = joined(names[k] for k in hold.markers)
        what = f"single vertices of the {hold.side} edge" if hold.corners else f"the whole {hold.side} edge"
        if not hold.own:
            how = "moves" if hold.moves else "stays in place"
            held.append(f"on what holds {what} and {how}: {of}")
        elif hold.corners and len(hold.markers) == 1:
            how = "moves" if hold.moves else "hardly moves"
            held.append(
                f"{of} {how}, and the {hold.side} row of markers hangs down from it: the cloth is held there alone"
            )
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
            held.append(f"the {_row(hold)} row of markers, {of}, {how}")
        if hold.edge is not None:
            how = "rests" if hold.tool is None else "moves as the tool does"
            held.append(
                f"the held edge is {1e3 * hold.edge.beyond:.3g} mm beyond the {_row(hold)} row of markers, with a "
                f"standard deviation of {1e3 * hold.edge.sd:.2g} mm: a parabola through the outer markers "
                f"of each column {how} there"
            )
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


def _row(hold: Hold) -> str:
    return {"top": "upper", "bottom": "lower"}.get(hold.side, hold.side)


def unknown_of(s: Seen, sheets: Sequence[Sheet], measured: Measured) -> list[str]:
    """What is not known, and what stands in its place."""
    held = [hold for sheet in sheets for hold in sheet.held]
    windy = any(sheet.wind is not None for sheet in sheets)
    return [
        *_of_holding(held),
        *_of_size(sheets, held),
        *_of_stiffness(sheets),
        _of_air(windy),
        _of_density(measured),
        *_of_holders_motion(s, held),
    ]


def _of_holding(held: Sequence[Hold]) -> list[str]:
    said = []
    if any(hold.own and not hold.corners for hold in held):
        said.append(
            "what holds the cloth: whole edges are taken. Change the set, or give a grip with the holder's markers"
        )
    if any(hold.corners for hold in held):
        said.append(
            "how large a patch is held at each corner: one vertex of the mesh is taken, and a cloth that is held at "
            "single vertices comes out too soft. Measure the patches, give each set their `radius`, and take smaller "
            "cells. One marker also does not show how a hand turns its patch: name two of each hand in its grip"
        )
    return said


def _of_size(sheets: Sequence[Sheet], held: Sequence[Hold]) -> list[str]:
    said = [
        "the size of the flat fabric: distances are taken as it hangs, stretched by its weight and the air. If that is "
        "1 %, the lowest markers are off by 1 % of the height, and the fitted tension is too stiff. Measure the edges "
        "and the markers on the flat cloth, and which way its warp runs, and correct mesh, origin and markers",
    ]
    for hold in held if all(sheet.margin is None for sheet in sheets) else ():
        if hold.margin is not None and hold.margin.edge is None:
            said.append(
                f"how far the held edge is beyond the {_row(hold)} row of markers: {1e3 * hold.margin.length:.0f} mm, "
                "half of the distance between rows, is taken, because the motion of the rows does not show it. Measure "
                "it with a ruler, and give --margin: in one example the "
                "prediction was off by 7 mm with the true 40 mm, and by 13 mm with 51 mm"
            )
    if any(sheet.margin is not None for sheet in sheets):
        return said
    part = "the same share of the distance between them as next to the held edge is taken"
    shares = {share(sheet.held) for sheet in sheets}
    if shares == {HALF}:
        part = "half of the distance between them is taken"
    elif shares == {0.0}:
        part = "nothing is taken, as beyond those in the hands"
    said.append(
        f"how far the cloth goes on beyond its other outer markers: {part}, and its weight and the air on it count. "
        "Measure it with a ruler, and give --margin, or `margin` of the mesh where sides differ"
    )
    return said


def _of_stiffness(sheets: Sequence[Sheet]) -> list[str]:
    said = []
    windy = any(sheet.wind is not None for sheet in sheets)
    sags = any(sheet.wind is None and "shear" in sheet.tension for sheet in sheets)
    pulls = ["the wind's pull"] * windy + ["its sag between its corners"] * sags
    if pulls:
        said.append(
            "how much the cloth is stretched: its flat size along warp and weft is fitted beside the tension, with a "
            "prior of 1 % about what the markers show. Give the sd of your own measurement where you have one. Both "
            "sizes rest on the places of the markers below, which a fit takes as exact: where these bend rows by 1 %, "
            "a size may be off by as much, outside its interval"
        )
        said.append(
            f"the stiffness in tension at the start: warp and shear begin at a guess, and {joined(pulls)} "
            f"{'shows' if len(pulls) == 1 else 'show'} them"
        )
    if any(sheet.slung for sheet in sheets):
        said.append(
            "the stiffness across, in shear and in bending: a slung cloth shows that along its length, which is fitted "
            "as `..._warp`, whichever way the threads run. It is only as good as the length of the flat fabric, which "
            "is fitted beside it: an error of 0.2 % is one of 15 to 40 % of the stiffness"
        )
    if any(not sheet.tension for sheet in sheets):
        said.append("the stiffness in tension: a hanging cloth hardly shows it. warp and shear are not fitted")
    return said


def _of_air(windy: bool) -> str:
    return (
        "how strongly the air acts at the start: `air_normal` begins with the value of a plate; a steady wind "
        "shows it only together with the wind's speed"
        if windy
        else "the wind: the air is taken to stand still, and `air_tangential`, its friction along the cloth, is a guess"
    )


def _of_density(measured: Measured) -> str:
    return (
        "the density: 0.2 kg/m^2 is assumed, and all other values are proportional to it. The intervals allow for 50 % "
        "of it (`[given]`): measure it, and give --density"
        if measured.density is None
        else "the mass of the markers"
    )


def _of_holders_motion(s: Seen, held: Sequence[Hold]) -> list[str]:
    if not any(hold.moves and hold.own and hold.tool is None for hold in held):
        return []
    rows = "the upper row's noise" if len(held) == 1 and held[0].side == "top" else "their noise"
    return [
        f"the true motion of the holder: {rows}, {1e3 * s.noise:.2g} mm in each coordinate, shakes "
        "the cloth, and the prediction is worse for it. Give the holder's own markers, or a robot's "
        'poses with --poses; or add `driven_sigma = "estimate"` to [[recording]], which takes many times as long'
    ]
