"""What an experiment refuses: options that do not exist, parts that overlap, and what does not go together."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..arrays.checks import is_bound, is_number
from ..errors import InputError
from ..recording.windows import Window
from ..scene.scene import Scene
from .force_sensor import ForceSensor

ENDLESS = 1e8  # substeps of a motion: more take days
LOSSES = ("squares", "soft_l1", "huber", "cauchy")  # the last for clouds alone


def check_errors(
    name: str, axes: str, radius: float | None, loss: str, loss_scale: float, sigma: float, is_cloud: bool
) -> None:
    """Refuse what errors of markers cannot be measured by, see the fields of `Experiment`."""
    if not (is_number(sigma) and sigma > 0):
        raise InputError(f"{name}.sigma", "must be positive", sigma, "give the expected error of a marker in m")
    if not isinstance(axes, str) or not axes or set(axes) - set("xyz") or len(set(axes)) != len(axes):
        raise InputError(f"{name}.axes", "must be some of x, y, z", axes, "give such as 'xz'")
    if radius is not None and not (is_number(radius) and radius > 0):
        raise InputError(
            f"{name}.radius", "must be positive", radius, "give the markers' distance from their pivot in m"
        )
    if loss not in LOSSES[: len(LOSSES) if is_cloud else -1]:
        known = "'squares', 'soft_l1' or 'huber', or for a cloud 'cauchy'"
        raise InputError(f"{name}.loss", "is unknown", loss, f"use {known}")
    if not (is_number(loss_scale) and loss_scale > 0):
        raise InputError(f"{name}.loss_scale", "must be positive", loss_scale, "give it in units of sigma")


def check_parts(
    name: str,
    fit: Window | None,
    held_out: Window | None,
    static: bool,
    start: str,
    start_time: float | None,
    predict: str | None,
) -> None:
    """Refuse parts of a recording that cannot be fitted or predicted, see the fields of `Experiment`."""
    if start not in ("given", "settled", "equilibrium", "estimated"):
        raise InputError(f"{name}.start", "is unknown", start, "use 'given', 'estimated' or 'equilibrium'")
    if start == "estimated" and (static or predict is not None):
        what = "an equilibrium" if static else "a recording that is only predicted"
        raise InputError(f"{name}.start", f"cannot be estimated for {what}", start, "leave it out")
    if predict not in (None, "window", "mean"):
        raise InputError(f"{name}.predict", "is unknown", predict, "use 'window' or 'mean', or leave it out")
    if start_time is not None and not is_number(start_time):
        raise InputError(f"{name}.start_time", "must be finite", start_time, "give a time of the recording in s")
    for part, window in (("fit", fit), ("held_out", held_out)):
        if window is not None and not _is_window(window):
            raise InputError(f"{name}.{part}", "must be (start, stop)", window, "give two times of the recording in s")
    if fit is not None and held_out is not None and max(fit[0], held_out[0]) < min(fit[1], held_out[1]):
        fix = "hold out frames that the fit does not see"
        raise InputError(f"{name}.held_out", "overlaps the fitted part", held_out, fix)
    if static and held_out is not None:
        fix = "hold out whole recordings: predict = 'mean'"
        raise InputError(f"{name}.held_out", "makes no sense for an equilibrium", held_out, fix)


def _is_window(window: object) -> bool:
    """Whether it is a pair of times, of which infinite ones are open ends."""
    if isinstance(window, np.ndarray):
        window = window.tolist()  # a number, where it has no axes
    if isinstance(window, str) or not isinstance(window, Sequence):
        return False
    return len(window) == 2 and all(is_bound(t) for t in window)


def check_substep(h: float, times: np.ndarray, of: str = "the recording") -> None:
    """Refuse a substep that is longer than the recording, or than a second where frames are ten times as dense (such a
    number is the rate that was meant), or so short that nothing would ever end.

    Args:
        h: s.
        times: (frames,) s, of what is simulated.
        of: what that is.

    Raises:
        InputError: it names `solver.h`.
    """
    if len(times) < 2:
        return
    span, interval = float(times[-1] - times[0]), float(np.median(np.diff(times)))
    if span / h > ENDLESS:
        problem, fix = f"makes {span / h:.2g} substeps of {span:.4g} s", f"give such as {interval / 10:.3g}"
        raise InputError("solver.h", problem, h, fix)
    if h <= span and not (h > 1.0 and h > 10.0 * interval):
        return
    problem = f"is the time of a substep, and {h:g} s is longer than "
    problem += f"{of} of {span:.4g} s" if h > span else f"ten frame intervals of {interval:.4g} s"
    fix = f"give {1 / h:.4g} for {h:g} substeps in a second" if h > 1.0 else f"give such as {interval / 10:.3g}"
    raise InputError("solver.h", problem, h, fix)


def check_driven_sigma(name: str, given: float | str | None, scene: Scene) -> None:
    """Refuse a noise of driven markers that is no noise, or has no markers."""
    if given is None:
        return
    if not (isinstance(given, str) and given == "estimate") and not (is_number(given) and given > 0):  # type: ignore[operator]
        fix = "give the noise of the driven markers in m, or 'estimate'"
        raise InputError(f"{name}.driven_sigma", "must be positive", given, fix)
    if not scene.boundary.following:
        fix = "let particles follow markers (Scene.follow, [[scene.drive]], [[scene.cloth.grip]]), or leave it out"
        raise InputError(f"{name}.driven_sigma", "has no driven marker to correct", given, fix)


def check_forces(name: str, sensors: Sequence[ForceSensor], scene: Scene, static: bool, unknown: str | None) -> None:
    """Refuse force sensors that share a name, or that a scene or an experiment cannot have, such as beside a field for
    which numbers are estimated along with the parameters."""
    if not isinstance(sensors, Sequence) or not all(isinstance(s, ForceSensor) for s in sensors):
        raise InputError(f"{name}.forces", "must be a list of sensors", sensors, "give [sb.ForceSensor(...)]")
    names = [sensor.name for sensor in sensors]
    if len(set(names)) != len(names):
        raise InputError(f"{name}.forces", "share a name", names, "give each sensor a name of its own")
    if sensors and static:
        fix = "give a motion, or fit a still load by its shape alone"
        raise InputError(f"{name}.forces", "are compared along motions, not at rest", names, fix)
    if sensors and unknown is not None:
        fix = f"leave out {unknown}, or the forces"
        raise InputError(f"{name}.forces", f"do not go with {unknown}", names, fix)
    for i, sensor in enumerate(sensors):
        sensor.check(scene, f"{name}.force[{i}]")
