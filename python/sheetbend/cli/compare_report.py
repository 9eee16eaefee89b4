"""What `sheetbend compare` says: which fit predicts better, how sure that is, and what differs."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

from ..quantities.wording import figures, short
from ..report.tables import Section
from ..result.estimate import Estimate
from ..statistics.intervals import NORMAL
from ..statistics.paired import FEWEST, Paired
from .written_fits import Written

_LONGEST = 40  # characters of a setting
_APART = 2.0  # standard deviations


def compare_sections(fits: Sequence[Written], pairs: Mapping[str, Paired | None]) -> list[Section]:
    """Tables and sentences, the first fit being the one that others are compared with."""
    return [_predictions(fits, pairs), _numbers(fits), *_model(fits)]


def compare_dict(fits: Sequence[Written], pairs: Mapping[str, Paired | None]) -> dict[str, Any]:
    """The comparison as values for JSON."""
    return {
        "first": fits[0].name,
        "others": {
            other.name: {
                "paired": None if (pair := pairs[other.name]) is None else asdict(pair),
                "settings": {k: [a, b] for k, a, b in _differences(fits[0], other)},
                "apart": _disagreeing(fits[0], other),
            }
            for other in fits[1:]
        },
    }


def _predictions(fits: Sequence[Written], pairs: Mapping[str, Paired | None]) -> Section:
    first, rows, notes = fits[0], [], []
    for fit in fits:
        pair = pairs.get(fit.name)
        own = [r.held_out for r in fit.result.recordings if r.held_out is not None]
        alone = math.sqrt(sum(e * e for e in own) / len(own)) if own else None
        cells: tuple[str, ...] = ("", "", "", "")
        if pair is not None:
            interval = "not known" if pair.lower is None else f"{short(pair.lower)} to {short(pair.upper or 0.0)}"
            cells = (f"{1e3 * pair.first:.4g}", f"{1e3 * pair.second:.4g}", short(pair.ratio), interval)
        rows.append((fit.name, "" if alone is None else f"{1e3 * alone:.4g}", *cells))
        if fit is not first:
            notes.append((fit.name, _sentence(first.name, pair)))
    headers = ("fit", "held out [mm]", f"{first.name} there [mm]", "own [mm]", "own/first", "95 % interval")
    return Section("Predictions of data that no fit saw", headers, tuple(rows), tuple(notes))


def _sentence(first: str, pair: Paired | None) -> str:
    if pair is None:
        return f"holds out no frame that {first} holds out too, so nothing can be compared"
    size = f"its error is {short(pair.ratio)} times that of {first}, and larger in {pair.worse:.0%} of the frames"
    if pair.lower is None:
        parts = "one independent stretch" if pair.stretches == 1 else f"{pair.stretches} independent stretches"
        return f"{size}; the held-out part has only {parts}, and {FEWEST} are needed to say how sure that is"
    sure = f"from {pair.stretches} independent stretches"
    if pair.clear:
        return f"{'predicts worse' if pair.ratio > 1.0 else 'predicts better'}: {size} ({sure})"
    return f"neither predicts better: {size}, which chance explains ({sure})"


def _numbers(fits: Sequence[Written]) -> Section:
    names = list(dict.fromkeys(e.name for fit in fits for e in fit.result.estimates))
    rows = []
    for name in names:
        own = [next((e for e in fit.result.estimates if e.name == name), None) for fit in fits]
        rows.append((name, *(_cell(e) for e in own)))
    notes = [(fit.name, "; ".join(words)) for fit in fits[1:] if (words := _disagreeing(fits[0], fit))]
    verdicts = [_verdicts(fits[0], fit) for fit in fits[1:]]
    notes += [(fit.name, words) for fit, words in zip(fits[1:], verdicts, strict=True) if words]
    return Section("Numbers and verdicts", ("parameter", *(fit.name for fit in fits)), tuple(rows), tuple(notes))


def _cell(e: Estimate | None) -> str:
    if e is None:
        return "-"
    value, half = figures((e.value, e.half_width), e.half_width)
    return f"{value}{' +/- ' + half if half else ''} {e.unit}".rstrip() + f" ({e.verdict})"


def _disagreeing(first: Written, other: Written) -> list[str]:
    """Parameters of both whose values lie farther apart than their intervals have it."""
    found = []
    for e in other.result.estimates:
        o = next((o for o in first.result.estimates if o.name == e.name), None)
        if o is None or e.half_width is None or o.half_width is None:
            continue
        sd = math.hypot(e.half_width, o.half_width) / NORMAL
        if sd > 0.0 and abs(e.value - o.value) > _APART * sd:
            found.append(f"{e.name} is {abs(e.value - o.value) / sd:.2g} standard deviations from that of {first.name}")
    return found


def _verdicts(first: Written, other: Written) -> str:
    """Which parameters have another verdict, or stand in one fit alone."""
    a, b = ({e.name: e.verdict for e in fit.result.estimates} for fit in (first, other))
    parts = [f"{n} is {b[n]}, and {a[n]} in {first.name}" for n in b if n in a and a[n] != b[n]]
    parts += [f"{n} is fitted here alone" for n in b if n not in a]
    parts += [f"{n} is fitted in {first.name} alone" for n in a if n not in b]
    return "; ".join(parts)


def _differences(first: Written, other: Written) -> list[tuple[str, Any, Any]]:
    a, b = first.settings, other.settings
    keys = [k for k in dict.fromkeys([*a, *b]) if a.get(k) != b.get(k)]
    return [(k, a.get(k), b.get(k)) for k in keys if not k.endswith((".initial", ".file")) and ".finer" not in k]


def _model(fits: Sequence[Written]) -> list[Section]:
    found = []
    for other in fits[1:]:
        differences = _differences(fits[0], other)
        rows = tuple((key, _text(a), _text(b)) for key, a, b in differences)
        notes = () if rows else (("", "nothing but where the fits start"),)
        found.append(Section(f"What {other.name} has set otherwise", ("key", fits[0].name, other.name), rows, notes))
    return found


def _text(value: Any) -> str:
    text = "left out" if value is None else str(value)
    return text if len(text) <= _LONGEST else text[: _LONGEST - 3] + "..."
