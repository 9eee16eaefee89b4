"""The page docs/constraints.md, made from what the kinds' headers say: `python -m sheetbend.quantities.kind_reference
docs/constraints.md` writes it."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from .kinds import KINDS, range_in_words

_HEAD = """# Constraints

Example: a spring of 200 N/m between two particles.

```python
import sheetbend as sb

scene = sb.Scene("spring")
scene.add_particles([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0]], 0.05)
scene.pin([0])
scene.add_constraints("distance", [[0, 1]], compliance=1 / 200)
print(sb.simulate(scene, [0.0, 0.1]).positions[-1, 1])
```

`Scene.add_constraints(kind, particles, compliance=..., damping=..., rest=..., normal=...)` adds constraints of one of
the kinds below. `particles` has one row per constraint. A constraint with the compliance alpha has the energy
|C|^2/(2 alpha). A `scalar` compliance weighs all rows of C equally. A `matrix` compliance is factored into the rows,
and parameters of the kind weigh them against each other. The array `rest` has one column for each parameter whose value
below comes from `rest`, in the order of the table.

`python -m sheetbend.quantities.kind_reference docs/constraints.md` makes this page from the headers in
`core/constraints`. Each header gives the equation, its source and what happens in degenerate shapes. In Python,
`sheetbend.KINDS` has the same information.
"""


def page() -> str:
    """The page as Markdown."""
    return "\n".join([_HEAD, *(_section(name, kind) for name, kind in KINDS.items())])


def _section(name: str, kind: Mapping[str, Any]) -> str:
    compliance = kind["compliance"]
    rigid = f"never zero: {compliance['never_zero']}" if compliance["never_zero"] else "zero is rigid"
    rows = "1 row" if kind["rows"] == 1 else f"{kind['rows']} rows"
    unilateral = "; pushes only" if kind["unilateral"] else ""
    lines = [
        f"## `{name}`",
        "",
        f"C{_in_brackets(kind['unit'])} is {kind['about']}: {kind['arity']} particles, {rows}{unilateral}.",
        "",
        f"- compliance {compliance['unit']}, a {compliance['form']}: {compliance['made_of']}; {rigid}",
        f"- damping {kind['damping']['unit']}",
    ]
    if kind["parameters"]:
        lines += ["", "| parameter | unit | range | value |", "| --- | --- | --- | --- |"]
        lines += [
            f"| `{parameter}` | {about['unit']} | {range_in_words(about)} | {_value(about)} |"
            for parameter, about in kind["parameters"].items()
        ]
    return "\n".join(lines) + "\n"


def _in_brackets(unit: str) -> str:
    return f" [{unit}]" if unit else ""


def _value(parameter: Mapping[str, Any]) -> str:
    return {
        "given": "`rest`, needed",
        "measured": "`rest`, else measured on the initial positions",
        "usual": f"`rest`, else {parameter['value']}",
        "normal": "`normal`, made a unit vector",
        "preset": f"{parameter['value']}, until a quantity makes it",
    }[parameter["source"]]


if __name__ == "__main__":
    Path(sys.argv[1]).write_text(page())
