"""Recordings of markers and of forces: their checks, their files, and what predicts them without physics."""
