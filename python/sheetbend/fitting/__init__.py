"""The fit as users call it, and the motion of what was fitted."""
