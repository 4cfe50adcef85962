"""The log of one flight: what was flown, measured and believed, and what the monitor said.

Entries are 10 ms apart. As CSV (`flight.csv`) there is one row an entry and robot; numbers have nine significant digits, so that
writing a log that was read gives the same bytes. Folders of runs keep logs of many robots as `large_logs` says.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from flight.model.attitude import Floats
from verify.data import Letter
from verify.recordings.flight_log import DIGITS, LOG_COLUMNS

ROTOR_COLUMNS = ("rotor1", "rotor2", "rotor3", "rotor4")
"""N, front left and on clockwise; only where the model has rotors."""

MEASURED_COLUMNS = ("mx", "my", "mz")
"""m, what motion capture saw, empty where it lost the robot; only where there was one."""


@dataclass(frozen=True, slots=True)
class Event:
    """Something that happened or was said during a flight.

    Attributes:
        time: s.
        robot: Whom it concerns, or None for the team.
        kind: `tube`, `formula`, `soft`, `separation`, `reaction` or `note`.
        sentence: For a person.
    """

    time: float
    robot: str | None
    kind: str
    sentence: str


@dataclass(frozen=True, eq=False)
class FlightLog:
    """One flight of a team. Arrays are read-only; samples first, robots second.

    Attributes:
        mission: The mission's name.
        robots: Names, in the mission's order.
        times: s. Shape (samples,).
        position: m, world frame. Shape (samples, robots, 3).
        velocity: m/s. Shape (samples, robots, 3).
        attitude: Roll, pitch, yaw in rad (Z-Y-X). Shape (samples, robots, 3).
        thrust: Collective, N. Shape (samples, robots).
        rates: Body rates, rad/s. Shape (samples, robots, 3).
        error: Distance from the planned position, m. Shape (samples, robots).
        letters: The letter of each robot at each sample: letters[sample][robot].
        rotors: Thrust of each rotor, N, or None. Shape (samples, robots, 4).
        measured: What motion capture saw, m, NaN where it lost the robot; or None. Shape (samples, robots, 3).
        estimated: Position that the controller believed at its last command, m; or None. Shape (samples, robots, 3).
        peak: Largest error of each robot at any step of the simulation, m. Shape (robots,), or None for recordings.
        margin: delta of the certificate in m, or None where there was no certificate.
        events: What the monitor said and what was done about it, in order.
        satisfied: Whether the flown path satisfies the formula, or None where that was not checked.
        tube: `inside`, `outside` or `unknown`; None without a certificate.
        seed: Of the simulation, or None.
        certificate: Digest of the certificate, or None.
        controllers: Who flew each robot, by name; None where that is not known.
        notes: Sentences for a person.
    """

    mission: str
    robots: tuple[str, ...]
    times: Floats
    position: Floats
    velocity: Floats
    attitude: Floats
    thrust: Floats
    rates: Floats
    error: Floats
    letters: tuple[tuple[Letter, ...], ...]
    rotors: Floats | None = None
    measured: Floats | None = None
    estimated: Floats | None = None
    peak: Floats | None = None
    margin: float | None = None
    events: tuple[Event, ...] = ()
    satisfied: bool | None = None
    tube: str | None = None
    seed: int | None = None
    certificate: str | None = None
    controllers: tuple[str, ...] | None = None
    notes: tuple[str, ...] = field(default=())

    def __repr__(self) -> str:
        judged = {True: "satisfied", False: "violated", None: "not judged"}[self.satisfied]
        lasts = f"{self.times[-1] - self.times[0]:.2f} s" if len(self.times) else "no samples"
        return f"<FlightLog of '{self.mission}', {', '.join(self.robots)}: {lasts}, formula {judged}, tube {self.tube or 'unknown'}>"

    def __post_init__(self) -> None:
        for name in (
            "times",
            "position",
            "velocity",
            "attitude",
            "thrust",
            "rates",
            "error",
            "rotors",
            "measured",
            "estimated",
            "peak",
        ):
            values = getattr(self, name)
            if values is not None:
                values = np.array(values, dtype=np.float64, order="C")
                values.setflags(write=False)
                object.__setattr__(self, name, values)

    def __len__(self) -> int:
        return len(self.times)

    def worst_error(self, robot: str | None = None) -> float:
        """Return a robot's (or any robot's) largest distance from the plan, m: over all steps of the simulation
        where they are known, else over the log.
        """
        worst = np.max(self.error, axis=0) if self.peak is None else self.peak
        return float(np.max(worst) if robot is None else worst[self.robots.index(robot)])

    def rms_error(self, robot: str | None = None) -> float:
        """Return the root mean square of a robot's (or all robots') distance from the plan, m."""
        error = self.error if robot is None else self.error[:, self.robots.index(robot)]
        return float(np.sqrt(np.mean(error**2)))

    @property
    def verdicts(self) -> tuple[str, ...]:
        """Verdicts on the flight, in order, a sentence each."""
        return tuple(event.sentence if event.time == 0.0 else f"{event.time:.2f} s: {event.sentence}" for event in self.events)

    @property
    def estimate_rms(self) -> float | None:
        """Root mean square of believed minus true position on an axis, m; None without motion capture."""
        return None if self.estimated is None else _axis_rms(self.estimated[::2] - self.position[::2])

    @property
    def measurement_rms(self) -> float | None:
        """Root mean square of measured minus true position on an axis, m; None without motion capture."""
        return None if self.measured is None else _axis_rms(self.measured - self.position)

    def word(self, robot: str) -> tuple[tuple[float, Letter], ...]:
        """Return a robot's letters as they were logged: the time of the first sample of each, and the letter."""
        column = self.robots.index(robot)
        entries: list[tuple[float, Letter]] = []
        for time, row in zip(self.times, self.letters, strict=True):
            if not entries or row[column] != entries[-1][1]:
                entries.append((float(time), row[column]))
        return tuple(entries)

    def to_csv(self) -> str:
        """Return the log as the text of flight.csv."""
        return "\n".join([",".join(self.columns), *self._lines(), ""])

    @property
    def columns(self) -> tuple[str, ...]:
        """The CSV's columns: those of every log, then rotors and measurements where there are any."""
        return (
            LOG_COLUMNS
            + (ROTOR_COLUMNS if self.rotors is not None else ())
            + (MEASURED_COLUMNS if self.measured is not None else ())
        )

    def _lines(self) -> Iterator[str]:
        """Yield the samples, robot by robot; names and letters hold nothing that CSV would quote."""
        parts = [self.position, self.velocity, self.attitude, self.thrust[..., None], self.rates, self.error[..., None]]
        extra = [values for values in (self.rotors, self.measured) if values is not None]
        main, rest = np.concatenate(parts, axis=-1), np.concatenate([*extra, np.zeros((*self.error.shape, 0))], axis=-1)
        before, after = f",%.{DIGITS}g" * main.shape[-1], f",%.{DIGITS}g" * rest.shape[-1]
        for i, time in enumerate(self.times):
            at = f"{float(time):.{DIGITS}g}"
            for robot, numbers, letter, more in zip(
                self.robots, main[i].tolist(), self.letters[i], rest[i].tolist(), strict=True
            ):
                yield f"{at},{robot}{_row(before, numbers)},{' '.join(sorted(letter))}{_row(after, more)}"


def _row(form: str, numbers: list[float]) -> str:
    """Return numbers with a comma before each; nothing for what is no number."""
    return (form % tuple(numbers)).replace("nan", "")


def _axis_rms(difference: Floats) -> float:
    return float(np.sqrt(np.nanmean(difference**2)))
