"""Scenes: what they hold, how they are built, compiled and saved."""
