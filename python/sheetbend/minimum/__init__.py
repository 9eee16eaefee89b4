"""From a least-squares problem to its minimum: optimizers, searches, windows, journals, limits of refinement."""
