"""Falling from rest against air: quadratic and linear drag. Continuous laws; tolerance 1e-3."""

import math


def terminal_velocity(mass_per_area: float, g: float, drag_coefficient: float, air_density: float) -> float:
    """O-11: terminal velocity [m/s] under quadratic drag: sqrt(2 m g/(rho C_d A)), `mass_per_area` = m/A.

    For a falling sheet m/A is the areal density; for a rope falling broadside, the linear density over the
    diameter. Derivatives: -v_t/(2 C_d), -v_t/(2 rho), v_t/(2 g), v_t/(2 m).
    """
    return math.sqrt(2.0 * mass_per_area * g / (air_density * drag_coefficient))


def quadratic_drag_velocity(t: float, g: float, terminal: float) -> float:
    """O-11: velocity [m/s] at time t after a start at rest: v_t tanh(g t/v_t)."""
    return terminal * math.tanh(g * t / terminal)


def quadratic_drag_distance(t: float, g: float, terminal: float) -> float:
    """O-11: distance fallen [m] at time t after a start at rest: v_t^2/g ln cosh(g t/v_t)."""
    x = g * t / terminal
    return terminal**2 / g * (x + math.log1p(math.expm1(-2.0 * x) / 2.0))


def linear_drag_velocity(t: float, g: float, rate: float) -> float:
    """O-11: velocity [m/s] from rest under v' = g - c v with `rate` c [1/s]: (g/c)(1 - e^(-c t))."""
    return -g / rate * math.expm1(-rate * t)


def linear_drag_distance(t: float, g: float, rate: float) -> float:
    """O-11: distance fallen [m] at time t after a start at rest under linear drag: (g t - v)/c."""
    return (g * t - linear_drag_velocity(t, g, rate)) / rate
