"""A recording with the scene that is to explain it, its force sensors, its clock and corrections of its motion."""
