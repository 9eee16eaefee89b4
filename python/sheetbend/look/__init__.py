"""A first look at a recording: what its markers show, and a configuration to fit that begins with it."""

from .draft import Draft, draft
from .seen import Seen, seen
from .take import Measured, Take

__all__ = ["Draft", "Measured", "Seen", "Take", "draft", "seen"]
