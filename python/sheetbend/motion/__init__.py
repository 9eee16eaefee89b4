"""Motion and rest: simulation, gradients through it, memory that they take, equilibrium, energies and forces."""
