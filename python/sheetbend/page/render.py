"""Templates, scripts and styles put together into one file that needs no network."""

from __future__ import annotations

import base64
import gzip
import json
import re
from importlib.resources import files
from typing import Any

from ..optional import require
from ..quantities.wording import raised
from ..report.tables import Section, flush_left

_PARTS = files(__package__)


def render(template: str, **values: Any) -> str:
    """A whole page; every value is escaped.

    Raises:
        MissingExtraError: jinja2 is not installed.
    """
    jinja2 = require("jinja2", "cli")
    loader = jinja2.FunctionLoader(lambda name: (_PARTS / "templates" / name).read_text(encoding="utf-8"))
    # Templates are ours; everything that a user, a file or a result puts into one is escaped.
    environment = jinja2.Environment(loader=loader, autoescape=True, trim_blocks=True, lstrip_blocks=True)
    environment.filters["coded"] = lambda text: _coded(jinja2.utils.markupsafe.escape(text))
    environment.filters["as_json"] = lambda value: jinja2.utils.markupsafe.Markup(as_json(value))
    environment.globals["asset"] = lambda name: jinja2.utils.markupsafe.Markup(_asset(name))
    return str(environment.get_template(template).render(**values))


def as_json(value: Any) -> str:
    """JSON that can stand inside a script element."""
    return json.dumps(value, allow_nan=False, separators=(",", ":")).replace("<", "\\u003c")


def compressed(text: str) -> str:
    """Text as gzip in base64, the same bytes every time."""
    return base64.b64encode(gzip.compress(text.encode(), mtime=0)).decode("ascii")


def table(section: Section) -> dict[str, Any]:
    """A report's section as the templates want it, without columns that are empty, and with raised powers."""
    columns = [k for k in range(len(section.headers)) if k == 0 or any(row[k] for row in section.rows)]
    left = flush_left(section)
    return {
        "title": section.title,
        "headers": [section.headers[k] for k in columns],
        "rows": [[raised(row[k]) for k in columns] for row in section.rows],
        "left": [left[k] for k in columns],
        "notes": [(label, raised(sentence)) for label, sentence in section.notes],
    }


def _coded(escaped: Any) -> Any:
    """What stands between grave accents as code, in escaped text."""
    return type(escaped)(re.sub(r"`([^`]+)`", r"<code>\1</code>", str(escaped)))


def _asset(name: str) -> str:
    text = (_PARTS / name).read_text(encoding="utf-8")
    return text.replace("</script", "<\\/script")
