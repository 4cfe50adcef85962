"""Setpoints to PX4 vehicles: looked at before, streamed by one clock under watch, and told to hold, or to land, whatever happens."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace

from flying.checks import Known, Place, Pose, checks_of_team, differing, refusals
from flying.px4 import AGAIN, Vehicle
from flying.record import FLIGHT, Record
from flying.reports import HOLD, LAND, OFFBOARD, PX4
from flying.watch import Refused, Team, Watch

CONNECT = 10.0  # s to wait for a vehicle's first heartbeat and positions
LOOK = 1.1  # s in which battery and estimator are reported twice
LEAD = 1.5  # s of setpoints before offboard flight is asked for; PX4 wants at least one second
ANSWER = 5.0  # s to wait for a change of mode, and for a parameter
LATE = 0.1  # s that a setpoint may be late; later ones are another flight than the certified one
AGE = 0.05  # s that a position may have been on its way


class Stream:
    """All vehicles of a flight.

    Attributes:
        team: Who flies.
        vehicles: In the same order.
        record: Takes in what happens.
        rate: Setpoints a second.
    """

    def __init__(self, team: Team, vehicles: list[Vehicle], record: Record) -> None:
        """Take what flies."""
        self.team, self.vehicles, self.record = team, vehicles, record
        self.rate: float = team.data["rate"]
        self._stage, self._watch = "", Watch(team, time.monotonic())

    # Before

    def check(self, unchecked: frozenset[str]) -> None:
        """Look at every vehicle, which hovers at its start, and set what acts on board when setpoints end.

        Args:
            unchecked: Checks without which the operator flies.

        Raises:
            Refused: Something is wrong; nothing was asked of any vehicle but reports and parameters.
        """
        self._reach()
        self.wait(time.monotonic() + LOOK)
        now = time.monotonic()
        starts: dict[str, Place] = {vehicle.name: vehicle.wanted(0) for vehicle in self.vehicles}
        asked = {name: self.team.asked(name, starts, "its start") for name in starts}
        found = checks_of_team(
            {vehicle.name: self._known(vehicle, now) for vehicle in self.vehicles}, asked, self.team.limits, now
        )
        found = [
            replace(check, sentence=f"{check.robot} is not armed: bring it to a hover at its start first")
            if check.name == "ready" and not check.passed
            else check
            for check in found
        ]
        for check in found:
            if check.passed is None:
                self.say(check.sentence, "check")
        if faults := refusals(found, unchecked):
            raise Refused("; ".join(faults))
        self._require_gains()
        self._set_failsafe()

    def _known(self, vehicle: Vehicle, now: float) -> Known:
        """Return what is known of a vehicle; its parameters are set, and read back, once all that only looks has passed."""
        self.record.said["batteries"][vehicle.name] = vehicle.says.charge
        health = replace(vehicle.health, ready=vehicle.says.armed)
        return Known(vehicle.since(now - self.team.limits["watched"]), health, "")

    def _reach(self) -> None:
        """Wait until all speak, and report often."""

        def often(vehicle: Vehicle) -> bool:
            return len(vehicle.since(time.monotonic() - 0.5)) >= 0.25 * self.rate

        def speaks(vehicle: Vehicle) -> bool:
            return vehicle.autopilot == PX4 and often(vehicle)

        def complete(vehicle: Vehicle) -> bool:
            return vehicle.says.ready_to_check

        def ask(vehicle: Vehicle) -> None:
            vehicle.ask_reports(self.rate)

        if self.wait(time.monotonic() + CONNECT, speaks, ask=ask):
            self.wait(time.monotonic() + LOOK, complete, ask=ask)  # what it does not say until then is not checked
            return
        faults: list[str] = []
        for vehicle in self.vehicles:
            if vehicle.autopilot != PX4 and vehicle.others:
                others = ", ".join(str(system) for system in sorted(vehicle.others))
                faults.append(
                    f"{vehicle.name} is system {vehicle.system}, and system {others} answers: look at addresses and at MAV_SYS_ID"
                )
            elif vehicle.autopilot != PX4 or not vehicle.poses:
                faults.append(f"no PX4 heartbeat and position from {vehicle.name} within {CONNECT:g} s: look at its address")
            elif not often(vehicle):
                faults.append(f"{vehicle.name} does not report its position {self.rate:g} times a second: look at its link")
        raise Refused("; ".join(faults))

    def _require_gains(self) -> None:
        """Read the gains with which each vehicle was simulated, and refuse others."""
        wanted: dict[str, dict[str, float]] = {name: row.get("gains", {}) for name, row in self.team.data["robots"].items()}

        def ask(vehicle: Vehicle) -> None:
            for key in wanted[vehicle.name].keys() - vehicle.says.board.keys():
                vehicle.read_parameter(key)

        self.wait(time.monotonic() + ANSWER, lambda vehicle: wanted[vehicle.name].keys() <= vehicle.says.board.keys(), ask=ask)
        found = {vehicle.name: differing(vehicle.says.board, wanted[vehicle.name]) for vehicle in self.vehicles}
        if any(found.values()):
            said = "; ".join(f"{name}: {', '.join(each)}" for name, each in found.items() if each)
            raise Refused(f"gains on board are not those that were simulated: {said}")

    def _set_failsafe(self) -> None:
        """Set what acts on board when setpoints end, and read it back."""
        wanted: dict[str, float] = self.team.data["failsafe"]

        def has(vehicle: Vehicle) -> bool:
            return all(vehicle.says.board.get(key) == value for key, value in wanted.items())

        def ask(vehicle: Vehicle) -> None:
            for key, value in wanted.items():
                vehicle.set_parameter(key, value)

        done = self.wait(time.monotonic() + ANSWER, has, ask=ask)
        self.record.said["parameters"] = {vehicle.name: dict(vehicle.says.board) for vehicle in self.vehicles}
        if not done:
            which = ", ".join(vehicle.name for vehicle in self.vehicles if not has(vehicle))
            said = ", ".join(f"{key} = {value:g}" for key, value in wanted.items())
            raise Refused(f"{which} does not take {said}: set what it does when setpoints end yourself, and look why")
        self.say(f"{wanted['COM_OF_LOSS_T']:g} s after its last setpoint each robot lands where it is, by itself", "check")

    # In flight

    def begin(self) -> None:
        """Bring all from hovering at their starts into offboard flight there.

        Raises:
            Refused: One does not change to offboard flight, or is not where it has to be then.
        """
        self._stage = "start"
        self.wait(time.monotonic() + LEAD, sending=True)
        if not self.wait(
            time.monotonic() + ANSWER,
            lambda vehicle: vehicle.says.mode == OFFBOARD,
            sending=True,
            ask=lambda vehicle: vehicle.ask_mode(OFFBOARD),
        ):
            others = [vehicle.name for vehicle in self.vehicles if vehicle.says.mode != OFFBOARD]
            raise Refused(f"{', '.join(others)} did not change to offboard flight within {ANSWER:g} s")
        starts = {name: row["start"] for name, row in self.team.data["robots"].items()}

        def faults(vehicles: list[Vehicle]) -> list[str]:
            poses = {vehicle.name: vehicle.poses[-1] for vehicle in vehicles}
            return self.team.start_faults(poses, starts, "its start", time.monotonic())

        patience = time.monotonic() + self.team.limits["patience"]
        self.wait(patience, lambda vehicle: not faults([vehicle]), sending=True)
        if found := faults(self.vehicles):
            raise Refused("; ".join(found))

    def fly(self) -> None:
        """Send all setpoints in real time, all robots by one clock.

        Raises:
            Refused: A setpoint was late, or something must not go on.
        """
        for vehicle in self.vehicles:
            vehicle.fly()
        begin = time.monotonic()
        self._watch = Watch(self.team, begin)
        self._stage = FLIGHT
        self.record.began(FLIGHT, begin)
        for index in range(max(len(vehicle.setpoints) for vehicle in self.vehicles)):
            due = begin + index / self.rate
            self.wait(due)
            late = time.monotonic() - due
            if late > LATE:
                raise Refused(f"the setpoint of {index / self.rate:.2f} s was {late:.2f} s late")
            self._require_in_flight()
            for vehicle in self.vehicles:
                vehicle.send(index)
        self.record.ended(FLIGHT, begin + self.team.data["duration"])
        for _ in range(4):
            self.wait(time.monotonic() + AGE, sending=True)
            self._require_in_flight()

    def _require_in_flight(self) -> None:
        """Refuse to go on where a robot has left offboard flight, or must not go on."""
        by_name = {vehicle.name: vehicle for vehicle in self.vehicles}
        self._watch.require(time.monotonic(), lambda name: by_name[name].health)

    def _seen(self, vehicle: Vehicle, pose: Pose) -> None:
        """Take in a pose."""
        if not self._stage:
            return
        off = vehicle.off()
        self.record.pose(self._stage, pose.time, vehicle.name, pose.position, vehicle.wanted(), off)
        if self._stage == FLIGHT:
            self._watch.see(vehicle.name, pose, off)

    # At the end

    def make_safe(self) -> list[str]:
        """Tell all robots in offboard flight to hold until they confirm it, and those that do not to land.

        Setpoints go on meanwhile, so that none drifts. Whoever was taken over by its pilot is left alone. A second Ctrl-C has all
        others land.

        Returns:
            A sentence on each robot that did not confirm to hold.
        """
        sentences: list[str] = []
        self._stage = "hold" if self._stage else ""
        told = asked = [vehicle for vehicle in self.vehicles if vehicle.asked_offboard]
        leave = {OFFBOARD}
        for mode, word in ((HOLD, "hold"), (LAND, "land")):
            try:
                told = self._told_to(told, mode, leave)
            except KeyboardInterrupt:
                self.say("interrupted again: all robots are told to land", "reaction")
                told, leave = asked, {OFFBOARD, HOLD}
                continue
            if not told:
                return sentences
            sentences += [f"{vehicle.name} does not answer to {word}" for vehicle in told]
        return [
            *sentences,
            *(
                f"{vehicle.name} has confirmed neither hold nor land: its own failsafe acts when setpoints end (COM_OF_LOSS_T); "
                "take the remote control"
                for vehicle in told
            ),
        ]

    def _told_to(self, vehicles: list[Vehicle], mode: tuple[int, int], leave: set[tuple[int, int]]) -> list[Vehicle]:
        """Ask vehicles for a mode until heartbeats from now on say that they have left others; return those that do not."""
        now = time.monotonic()

        def done(vehicle: Vehicle) -> bool:
            return vehicle not in vehicles or (vehicle.says.beats > now and vehicle.says.mode not in leave)

        def ask(vehicle: Vehicle) -> None:
            if vehicle.says.mode in leave:
                vehicle.ask_mode(mode)

        self.wait(now + ANSWER, done, sending=True, ask=ask)
        return [vehicle for vehicle in vehicles if not done(vehicle)]

    def say(self, sentence: str, kind: str = "note") -> None:
        """Note what happened, and say it.

        Args:
            sentence: For a person.
            kind: As `Record.event` has it.
        """
        self.record.event(time.monotonic(), sentence, kind)

    def wait(
        self,
        until: float,
        ready: Callable[[Vehicle], bool] | None = None,
        *,
        sending: bool = False,
        ask: Callable[[Vehicle], None] | None = None,
    ) -> bool:
        """Listen until a time (of `time.monotonic`) or until `ready` holds of every vehicle; meanwhile keep each where it is.

        Args:
            until: s, of `time.monotonic`.
            ready: Told a vehicle; None to listen for the whole time.
            sending: Whether the last sent setpoint (the first, before any) is sent again and again.
            ask: Told, every `AGAIN` seconds, each vehicle that is not ready: a command may be lost.

        Returns:
            Whether all were ready; True where nothing was waited for.
        """
        begin, sent, asked = time.monotonic(), 0, float("-inf")
        while (now := time.monotonic()) < until:
            for vehicle in self.vehicles:
                vehicle.beat()
                vehicle.listen(self._seen)
            if ready is not None and all(ready(vehicle) for vehicle in self.vehicles):
                return True
            if ask is not None and now >= asked + AGAIN:
                asked = now
                for vehicle in self.vehicles:
                    if ready is None or not ready(vehicle):
                        ask(vehicle)
            if sending and now >= begin + sent / self.rate:
                sent += 1
                for vehicle in self.vehicles:
                    vehicle.send()
            time.sleep(0.002)
        return ready is None
