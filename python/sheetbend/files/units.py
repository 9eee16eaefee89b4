"""The units of length that files may be in."""

METERS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3}
