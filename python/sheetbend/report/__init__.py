"""Reports: tables, the sections of a fit's report, scores, and the result that users hold."""

from ..moved import old_contents

__getattr__ = old_contents(__name__)
