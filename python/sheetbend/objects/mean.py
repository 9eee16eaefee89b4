"""The weighted mean of many particles as a particle: a weight that hangs on a face, a face that is held in its mean."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..arrays.checks import check_label, finite, is_number
from ..errors import SceneError
from ..scene.given import check_scene
from ..scene.scene import Scene
from .joint_making import ground

MOST = 6  # nodes in the sum of one constraint


def add_mean(
    scene: Scene, particles: ArrayLike, weights: ArrayLike | None = None, *, name: str = "mean", mass: float = 1e-6
) -> int:
    """Add a particle that stays at the weighted mean of others, such as those of the end face of a solid.

    What holds, loads or pulls it acts on all of them, each with its weight, and does not keep them in shape: pin it,
    give it a point mass or a force, or constrain it. A marker on it shows the mean.

    The constraint `coincide` sums up to six nodes. Of more particles there are means of parts, hidden nodes. Sweeps
    move these light nodes too slowly, so the method "gauss_seidel" refuses such scenes.

    Args:
        scene: of the particles.
        particles: (k,) three or more, each once.
        weights: (k,) positive, such as `mesh.areas(mesh.sets["x_max"])` of a solid; their scale plays no part. Equal
            by default.
        name: of the group of rigid constraints.
        mass: of the particle and of each hidden node, kg. Make it small beside the mass of the particles.

    Returns:
        The number of the new particle. It starts at the mean for all values of the quantities.

    Raises:
        SceneError: fewer than three particles, some twice, weights or a mass that are not positive, or a name that is
            taken.
    """
    check_scene(scene)
    check_label("mean.name", name)
    own = scene.node_array(f"{name}.particles", particles)
    if any(group.name == name for group in scene.groups):
        raise SceneError("mean.name", "is taken by another group", name, "give each mean a name of its own")
    if len(own) < 3:
        raise SceneError(f"{name}.particles", "must be three or more", own.tolist(), "hold or load fewer themselves")
    if len(np.unique(own)) < len(own):
        raise SceneError(f"{name}.particles", "must differ", own.tolist(), "list each particle once, give it a weight")
    w = np.ones(len(own)) if weights is None else finite(f"{name}.weights", weights, (len(own),), SceneError)
    if not (w > 0).all():
        raise SceneError(f"{name}.weights", "must be positive", w.tolist(), "leave out particles without a weight")
    if not (is_number(mass) and mass > 0):
        raise SceneError(f"{name}.mass", "must be positive", mass, "give kg, small beside the particles' mass")
    shares, x = w / w.sum(), scene.nodes[own]
    world, *axes = ground(scene).particles.tolist()
    stencils, factors, parts = [], [], list(zip(own.tolist(), shares, strict=True))
    while len(parts) > 1:
        some, parts = parts[:MOST], parts[MOST:]
        first = len(own) - len(parts)
        total = float(shares[:first].sum())
        of, share = own[:first], shares[:first] / total
        add = scene.add_hidden if parts else scene.add_particles
        node = int(add((share @ x[:first])[None], mass)[0])
        scene.means[node] = (of, share)
        by = np.zeros(MOST)
        by[: len(some)] = [share / total for _, share in some]
        nodes = [*(p for p, _ in some), *axes, int(own[0])]  # filled up to six, without a share
        stencils.append([world, node, *nodes[:MOST]])
        factors.append([*by[:3], *-by[3:]])
        parts = [(node, total), *parts]
    scene.add_constraints("coincide", stencils, name=name, rest=factors)
    return node
