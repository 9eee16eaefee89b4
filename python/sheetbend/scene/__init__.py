"""Scenes: what they hold, how they are built, compiled and saved."""

from ..moved import old_contents

__getattr__ = old_contents(__name__)
