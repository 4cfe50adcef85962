"""Flights of the geometric controller under the disturbances of docs/tracking.md, by the simulator's own parts: many at once."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from flight.control.flatness import feed_forward, lifted
from flight.control.geometric import GEOMETRIC
from flight.model.airframe import airframe_of
from flight.model.attitude import error_vector, from_matrix, norm, quaternion_product, quaternion_rate, unit
from flight.model.autopilot import Autopilot, Held
from flight.model.dynamics import ATTITUDE, POSITION, RATES, VELOCITY, QuadcopterDynamics, hover_state
from flight.model.plant import Motion
from flight.model.timing import CONTROL_STEP, STEP, SUBSTEPS


@dataclass
class Disturbed:
    """Disturbances of n flights; each function is told the time in s and returns (3, n)."""

    n: int
    wind: object = None
    place: object = None
    gyroscope: object = None
    late: object = 0  # steps on board, a number or by command
    speed: object = None  # m/s, error of the velocity that is given
    attitude: object = None  # rad, error of the attitude on board
    drag: float = 1.0  # times the airframe's
    inertia: tuple = (1.0, 1.0, 1.0)  # times the vehicle's
    mass: np.ndarray | None = None  # share
    thrust: np.ndarray | None = None  # share
    offset: np.ndarray | None = None  # m, at the start
    given: object = None  # what set-points say, by command and path; else the plan's at that instant. Shape (5, 4, n)
    rest: dict = field(
        default_factory=dict
    )  # (3, n) each: speed, turn, tilt (a rotation vector with the heading), summed; rotors (4, n)
    log: list = field(default_factory=list)  # of every step, where `watch` is set: what the proof bounds
    begun: list = field(default_factory=list)  # the same, at the beginning of each step
    watch: bool = False
    moment: object = None  # N m about the body's axes, by time. Shape (3, n)
    centre: np.ndarray | None = None  # m from the rotors' middle to the centre of mass, body's axes. Shape (3, n)
    sag: object = None  # share by which thrust is more than at the start, by time. Shape (n,)
    battery: float = 1.0  # share of the rotors' greatest speed that is left
    behind: float = 0.0  # s, of a further lag between commands and rotors, which the model has not

    def fly(self, vehicle, path, duration):
        """Return positions after every step less the planned ones, m. Shape (steps, 3, n)."""
        n, frame = self.n, airframe_of(vehicle)
        mass = vehicle.mass * (np.ones(n) if self.mass is None else self.mass)
        root = np.sqrt(np.ones(n) if self.thrust is None else self.thrust)
        inertia = tuple(share * own for share, own in zip(self.inertia, vehicle.inertia, strict=True))
        true = frame.changed(
            vehicle=vehicle.changed(inertia=inertia),
            rotor_drag=self.drag * frame.rotor_drag,
            inflow_drag=self.drag * frame.inflow_drag,
            drag_range=None,
        )
        dynamics = QuadcopterDynamics(true, mass=mass)
        autopilot = Autopilot(QuadcopterDynamics(frame))
        start = np.tile(path.evaluate(0.0)[:, None], (1, n))
        begun = start[:3] + (np.zeros((3, n)) if self.offset is None else self.offset)
        state = hover_state(frame, begun, start[3])
        state[13:] *= root
        moving, summed = self.rest.get("speed", np.zeros((3, n))), self.rest.get("summed", np.zeros((3, n)))
        state[VELOCITY], state[RATES] = moving, self.rest.get("turn", state[RATES])
        tilted = self.rest.get("tilt", np.zeros((3, n)))
        state[ATTITUDE] = unit(state[ATTITUDE] + quaternion_rate(state[ATTITUDE], tilted))
        state[13:] *= np.sqrt(self.rest.get("rotors", 1.0))
        level = np.full(n, vehicle.weight)
        none = np.zeros((3, n))
        held = Held(
            None, none, none, level, np.zeros(n), np.full((4, n), frame.hover_speed) * state[13:] / (frame.hover_speed * root)
        )
        loop = GEOMETRIC.begin(frame, start)
        loop._summed = summed
        past = [state.copy() for _ in range(13)]
        for age, before in enumerate(reversed(past)):
            before[POSITION] = state[POSITION] - age * STEP * moving
        zero = np.zeros((3, n))
        reached, share = np.full((4, n), frame.hover_speed), -np.expm1(-STEP / self.behind) if self.behind else 1.0
        ticks = int(np.ceil(round(duration / CONTROL_STEP, 3)))
        errors = np.empty((ticks * SUBSTEPS, 3, n))
        for tick in range(ticks):
            t = tick * CONTROL_STEP
            seen = past[-1 - (self.late(tick) if callable(self.late) else self.late)]
            noise = self.place(t) if self.place else zero
            drift = self.speed(t) if self.speed else zero
            now = Motion(seen[POSITION] + noise, seen[VELOCITY] + drift, self._attitude(state, t), state[RATES])
            planned = np.stack([np.tile(path.evaluate(t, k)[:, None], (1, n)) for k in range(5)])
            flat = self.given(tick, path) if self.given else planned
            held = Held.of(loop.command(flat, now), held.rotors)
            off, drift = flat[0, :3] - now.position, flat[1, :3] - now.velocity
            fed = loop._position * off + loop._velocity * drift + loop._summed  # the feedback
            fed = fed + flat[2, :3] - planned[2, :3] + loop._damping * (flat[1, :3] - planned[1, :3])
            force = lifted(planned[2, :3] + loop._damping * planned[1, :3]) + fed
            for sub in range(SUBSTEPS):
                at = t + sub * STEP
                rates = state[RATES] + (self.gyroscope(at) if self.gyroscope else 0.0)
                if self.watch:
                    self.begun.append(
                        self._seen(frame, state, held, fed, force, self._reference(loop, path, t, sub * STEP, flat[0, 3]))
                    )
                ceiling = np.full(n, self.battery)
                asked, held = autopilot.rotor_commands(held, self._attitude(state, at), rates, ceiling, STEP)
                reached = reached + share * (asked - reached)
                state = self._turned(true, state, at)
                pull = root * np.sqrt(1.0 + self.sag(at)) if self.sag else root
                state = dynamics.step(state, reached * pull, self.wind(at) if self.wind else 0.0, STEP)
                past = [*past[-12:], state]
                if self.watch:
                    reference = self._reference(loop, path, t, (sub + 1) * STEP, flat[0, 3])
                    self.log.append(self._seen(frame, state, held, fed, force, reference))
                errors[tick * SUBSTEPS + sub] = state[POSITION] - path.evaluate(at + STEP)[:3, None]
        return errors

    def _turned(self, true, state, t):
        """Return the state with what a further moment, and a centre of mass that is off, add to the rates in a step."""
        if self.moment is None and self.centre is None:
            return state
        moment = np.zeros((3, self.n)) if self.moment is None else self.moment(t)
        if self.centre is not None:  # the thrust acts beside it
            thrust = true.thrust_coefficient * (state[13:] ** 2).sum(0)
            moment = moment + thrust * np.stack([-self.centre[1], self.centre[0], 0.0 * thrust])
        after = state.copy()
        after[RATES] += STEP * moment / np.array(true.vehicle.inertia)[:, None]
        return after

    def _attitude(self, state, t):
        """Return the attitude that is known on board."""
        if self.attitude is None:
            return state[ATTITUDE]
        return unit(state[ATTITUDE] + quaternion_rate(state[ATTITUDE], self.attitude(t)))

    @staticmethod
    def _reference(loop, path, t, since, heading):
        """Return the length of the plan's force some time after a command, rates and their change that are held of it, and the attitude that turned on so, at a heading."""

        def force_at(time, order):
            value = path.evaluate(time, order + 2)[:3, None] + loop._damping * path.evaluate(time, order + 1)[:3, None]
            return lifted(value) if order == 0 else value

        now, here, zero = [force_at(t, order) for order in range(3)], force_at(t + since, 0), np.zeros_like(heading)
        ahead = feed_forward(*(np.tile(part, (1, len(heading))) for part in now), zero, zero, zero)
        moved = [path.evaluate(t + since, order)[:3, None] for order in range(2)]
        north = np.stack([np.cos(0.5 * heading), zero, zero, np.sin(0.5 * heading)])
        turn = quaternion_product(north, from_matrix(ahead.turn))  # turns on as the autopilot lets what is commanded
        for step in range(round(since / STEP)):
            mean = ahead.rates + (step + 0.5) * STEP * ahead.rates_change
            half = 0.5 * STEP * norm(mean)
            turn = quaternion_product(turn, np.concatenate([np.cos(half)[None], 0.5 * STEP * np.sinc(half / np.pi) * mean]))
        return norm(here), ahead.rates + since * ahead.rates_change, ahead.rates_change, since, moved, turn, (now[0], heading)

    @staticmethod
    def _seen(frame, state, held, fed, force, reference):
        """Return feedback, and errors of tilt, rates, moments and thrust as the proof counts them. By name, (n,)."""
        scale, planned, change, since, moved, ahead, (begun, heading) = reference
        rates = state[RATES]
        squares = frame.thrust_coefficient * held.rotors * held.rotors
        arm, (jx, jy, _) = frame.vehicle.arm / np.sqrt(2.0), frame.vehicle.inertia
        ax = arm * (squares[0] - squares[1] - squares[2] + squares[3]) / jx
        ay = -arm * (squares[0] + squares[1] - squares[2] - squares[3]) / jy
        inverse = ahead * np.array([1.0, -1.0, -1.0, -1.0])[:, None]
        apart = quaternion_product(np.broadcast_to(inverse, state[ATTITUDE].shape), state[ATTITUDE])
        q = 2.0 * np.sign(apart[0]) * apart[1:]  # twice the vector of the attitude beside the plan's
        whole, cosine, sine = begun + fed, np.cos(heading), np.sin(heading)
        aim = np.stack([cosine * whole[0] + sine * whole[1], cosine * whole[1] - sine * whole[0]]) - begun[:2]
        d = scale * np.stack([q[1], -q[0]]) - aim
        e = scale * np.stack([rates[1] - planned[1], planned[0] - rates[0]])
        mu = scale * np.stack([ay - change[1], change[0] - ax])
        f, o = q[2], rates[2] - planned[2]
        model = squares.sum(0) / frame.vehicle.mass
        asked = norm(force) + held.thrust_rate / frame.vehicle.mass * since
        slow = squares[0] - squares[1] + squares[2] - squares[3]
        spin = frame.vehicle.torque_to_thrust / frame.vehicle.inertia[2] * slow - change[2]
        gains, error = frame.gains, error_vector(held.attitude, state[ATTITUDE])
        eager = (
            held.rates_change[2] - change[2] - spin - gains.attitude[1] * error[2] - gains.rate[1] * (rates[2] - held.rates[2])
        )
        keen = np.hypot(
            held.rates_change[0] - ax - gains.attitude[0] * error[0] - gains.rate[0] * (rates[0] - held.rates[0]),
            held.rates_change[1] - ay - gains.attitude[0] * error[1] - gains.rate[0] * (rates[1] - held.rates[1]),
        )
        off, drift = state[POSITION] - moved[0], state[VELOCITY] - moved[1]
        flat = {"xi": off[:2], "nu": drift[:2], "d": d, "e": e, "mu": mu, "p": fed[:2]}
        up = {"xi": off[2:], "nu": drift[2:], "b": (model - asked)[None], "p": fed[2:]}
        turn = {"f": f[None], "o": o[None], "mu": spin[None]}
        return {
            "lateral": flat, "vertical": up, "heading": turn, "p": np.hypot(fed[0], fed[1]), "p_up": np.abs(fed[2]), "d": np.hypot(*d), "e": np.hypot(*e), "mu": np.hypot(*mu),
            "twist": np.abs(error[2]), "ahead": keen, "ahead_spin": np.abs(eager), "f": np.abs(f), "o": np.abs(o), "b": np.abs(model - asked),
        }  # fmt: skip
