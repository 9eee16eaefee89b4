"""The page of a fabric."""

from __future__ import annotations

import base64
import shlex
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ..config.fabric_tests import FabricStudy
from ..page import fabric_page
from ..page.shown import of_positions
from ..report.tables import Section
from ..textile import WholeFabric
from ..version import __version__
from .fabric_figures import draped_rest

_CAPTIONS = {
    "warp": "pulls along the warp",
    "weft": "pulls along the weft",
    "drape": "shadows of the drape test, from above",
}


def fabric_page_of(
    study: FabricStudy, found: WholeFabric, sections: Sequence[Section], pictures: Sequence[Path], file: Path
) -> str:
    """The page of a fabric as HTML text; a drape is drawn in space."""
    motions = []
    if study.config.drape is not None:
        rest = draped_rest(study, found)
        motions = [of_positions(rest.scene, np.zeros(1), rest.nodes[None], "drape")]
    drawn = [(_CAPTIONS[p.stem], base64.b64encode(p.read_bytes()).decode("ascii")) for p in pictures]
    return fabric_page(
        study.config.fabric.name,
        sections,
        motions,
        drawn,
        estimates=found.fit.estimates,
        about=study.config.fabric.about,
        configuration=file.read_text(encoding="utf-8"),
        command=shlex.join(["sheetbend", "fabric", str(file)]),
        version=__version__,
    )
