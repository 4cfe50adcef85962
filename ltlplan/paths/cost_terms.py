"""The cost terms that come with the package, for a thousand sampled paths at once.

  length   integral of |r'| dt, m
  effort   integral of |r''| dt, m/s (the 2022 paper's u = r'')
  time     duration, s
  snap     integral of |r''''|^2 dt, m^2/s^7
  energy   integral of (|f|/g)^(3/2) dt with f = r'' + g e3: hover power times s, by momentum theory

A term is a function from `SampledPaths` to one number a path, registered by one line (`verify.data.names.choices`); another package brings
one by an entry point of the group `ltlplan.cost_terms`.
"""

from __future__ import annotations

from ltlplan.paths.costs import Floats, SampledPaths, norm, square
from verify.data import GRAVITY


def length(paths: SampledPaths) -> Floats:
    """Return how long the paths are, m. Shape (paths,)."""
    return paths.length


def effort(paths: SampledPaths) -> Floats:
    """Return the integral of the acceleration's norm, m/s. Shape (paths,)."""
    return paths.integral(norm(paths.unscaled(2))) / paths.scale**2


def time(paths: SampledPaths) -> Floats:
    """Return how long the flights take, s. Shape (paths,)."""
    return paths.duration


def snap(paths: SampledPaths) -> Floats:
    """Return the integral of the squared fourth derivative, m^2/s^7. Shape (paths,)."""
    return paths.integral(square(paths.unscaled(4))) / paths.scale**8


def energy(paths: SampledPaths) -> Floats:
    """Return what hovering rotors need by momentum theory: hover power times s. Shape (paths,)."""
    acceleration = paths.axes(2)
    vertical = acceleration[:, 2] + GRAVITY
    total = acceleration[:, 0] ** 2 + acceleration[:, 1] ** 2 + vertical**2
    return paths.integral((total / GRAVITY**2) ** 0.75)
