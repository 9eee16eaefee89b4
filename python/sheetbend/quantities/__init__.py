"""Named numbers: quantities of scenes, parameters of fits, units of constraints, and how reports write them."""
