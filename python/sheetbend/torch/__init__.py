"""PyTorch: rollouts and equilibria as differentiable functions of tensors, and a Module that learns named quantities.

The only part of sheetbend that imports torch. Everything here is computed in float64 on the CPU; tensors of float32 are
taken, and give results of float32. It works with autograd (rollouts twice, equilibria once) and with torch.func: grad,
vjp, jvp, vmap, jacrev, jacfwd, hessian. Arrays of float64 pass between torch and the core without copies.
"""

from ..optional import require

require("torch", "torch")

from .equilibrium import Equilibrium, equilibrium  # noqa: E402
from .forces import forces  # noqa: E402
from .module import SceneModule  # noqa: E402
from .simulate import Simulation, simulate  # noqa: E402
from .state import State  # noqa: E402
from .stepper import Stepper  # noqa: E402

__all__ = ["Equilibrium", "SceneModule", "Simulation", "State", "Stepper", "equilibrium", "forces", "simulate"]
