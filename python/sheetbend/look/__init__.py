"""A first look at a recording: what its markers show, and a configuration to fit that begins with it."""

from .draft import Draft, draft
from .seen import Seen, seen

__all__ = ["Draft", "Seen", "draft", "seen"]
