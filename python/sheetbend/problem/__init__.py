"""The least-squares problem of experiments and parameters, and how it is evaluated: journals, workers, counts."""

from ..moved import old_contents

__getattr__ = old_contents(__name__)
