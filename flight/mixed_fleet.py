"""Vehicles of several airframes in one simulation: each kind flies and is controlled as if it were alone, side by side.

All arithmetic of models and controllers is element by element along the vehicles, so that a robot flies the same, to the last bit,
whichever robots are beside it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from flight.control.controller import Controller, ControlLoop
from flight.model.airframe import Airframe
from flight.model.attitude import Floats
from flight.model.plant import AirframeModel, Command, Motion, Plant


@dataclass(frozen=True, eq=False, slots=True)
class Kind:
    """Vehicles of one airframe.

    Attributes:
        airframe: What they are.
        columns: Which of all vehicles. Shape (vehicles of this kind,).
    """

    airframe: Airframe
    columns: NDArray[np.intp]


def kinds_of(airframes: Sequence[Airframe], runs: int) -> tuple[Kind, ...]:
    """Return the vehicles of each airframe, in order of their first robots.

    Args:
        airframes: One for each robot of a run.
        runs: How many runs stand side by side, run by run.
    """
    found: dict[Airframe, list[int]] = {}
    for column in range(runs * len(airframes)):
        found.setdefault(airframes[column % len(airframes)], []).append(column)
    return tuple(Kind(airframe, np.array(columns)) for airframe, columns in found.items())


def begin(kinds: Sequence[Kind], model: AirframeModel, controller: Controller, start: Floats) -> tuple[Plant, ControlLoop]:
    """Return vehicles that hover, and what controls them.

    Args:
        kinds: Which vehicles are of which airframe.
        model: How they fly.
        controller: Who follows the plan.
        start: x, y, z in m and heading in rad. Shape (4, n).
    """
    plants = [model.begin(kind.airframe, start[:, kind.columns]) for kind in kinds]
    loops = [controller.begin(model.known(kind.airframe), start[:, kind.columns]) for kind in kinds]
    if len(kinds) == 1:
        return plants[0], loops[0]
    columns = tuple(kind.columns for kind in kinds)
    return _SideBySide(plants, columns), _Loops(loops, columns)


class _SideBySide(Plant):
    def __init__(self, plants: Sequence[Plant], columns: Sequence[NDArray[np.intp]]) -> None:
        self._plants, self._columns = tuple(plants), tuple(columns)

    @property
    def position(self) -> Floats:
        return self._joined([plant.position for plant in self._plants])

    @property
    def thrust(self) -> Floats:
        return self._joined([plant.thrust for plant in self._plants])

    @property
    def rotors(self) -> Floats | None:
        parts = [part for part in (plant.rotors for plant in self._plants) if part is not None]
        return self._joined(parts) if len(parts) == len(self._plants) else None

    @property
    def charge(self) -> Floats:
        return self._joined([plant.charge for plant in self._plants])

    def motion(self) -> Motion:
        parts = [plant.motion() for plant in self._plants]
        names: tuple[Literal["position", "velocity", "attitude", "rates"], ...] = ("position", "velocity", "attitude", "rates")
        return Motion(*(self._joined([getattr(part, name) for part in parts]) for name in names))

    def felt(self) -> Floats:
        return self._joined([plant.felt() for plant in self._plants])

    def follow(self, command: Command) -> None:
        for plant, own in zip(self._plants, self._columns, strict=True):
            attitude = None if command.attitude is None else command.attitude[..., own]
            plant.follow(
                Command(
                    command.thrust[own], command.thrust_rate[own], command.rates[:, own], command.rates_change[:, own], attitude
                )
            )

    def step(self, wind: Floats | float) -> None:
        for plant, own in zip(self._plants, self._columns, strict=True):
            plant.step(wind if isinstance(wind, float | int) else wind[:, own])

    def fly(self, wind: Floats | float, count: int) -> Floats:
        return self._joined(
            [
                plant.fly(wind if isinstance(wind, float | int) else wind[:, own], count)
                for plant, own in zip(self._plants, self._columns, strict=True)
            ]
        )

    def _joined(self, parts: Sequence[Floats]) -> Floats:
        return joined(parts, self._columns)


class _Loops:
    def __init__(self, loops: Sequence[ControlLoop], columns: Sequence[NDArray[np.intp]]) -> None:
        self._loops, self._columns = tuple(loops), tuple(columns)

    def command(self, flat: Floats, now: Motion) -> Command:
        parts = [
            loop.command(
                flat[..., own],
                Motion(now.position[:, own], now.velocity[:, own], now.attitude[:, own], now.rates[:, own]),
            )
            for loop, own in zip(self._loops, self._columns, strict=True)
        ]
        attitudes = [part.attitude for part in parts if part.attitude is not None]
        return Command(
            joined([part.thrust for part in parts], self._columns),
            joined([part.thrust_rate for part in parts], self._columns),
            joined([part.rates for part in parts], self._columns),
            joined([part.rates_change for part in parts], self._columns),
            joined(attitudes, self._columns) if len(attitudes) == len(parts) else None,
        )


def joined(parts: Sequence[Floats], columns: Sequence[NDArray[np.intp]]) -> Floats:
    """Return arrays of several kinds as one of all vehicles. Shapes (..., vehicles of the kind) to (..., n).

    Args:
        parts: One for each kind.
        columns: Which vehicles each is of.
    """
    whole = np.empty((*parts[0].shape[:-1], sum(len(own) for own in columns)))
    for part, own in zip(parts, columns, strict=True):
        whole[..., own] = part
    return whole
