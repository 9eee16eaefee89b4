"""Optional dependencies: imported where they are used, with a clear error where they are missing."""

from __future__ import annotations

import importlib
from types import ModuleType

from .errors import SheetbendError


class MissingExtraError(SheetbendError, ImportError):
    """A function needs a package that is not installed.

    Args:
        package: the package that is missing.
        extra: the extra of sheetbend that brings it.
    """

    def __init__(self, package: str, extra: str) -> None:
        super().__init__(package, extra)
        self.package = package
        self.extra = extra

    def __str__(self) -> str:
        return f"this needs {self.package}, which is not installed. Fix: pip install 'sheetbend[{self.extra}]'."


def require(module: str, extra: str) -> ModuleType:
    """Import `module`, or say which extra brings it.

    Raises:
        MissingExtraError: its package is not installed.
    """
    package = module.partition(".")[0]
    try:
        return importlib.import_module(module)
    except ModuleNotFoundError as error:
        if error.name is None or error.name.partition(".")[0] != package:
            raise  # the package is there, something inside it is broken: do not hide that
        raise MissingExtraError(package, extra) from error
