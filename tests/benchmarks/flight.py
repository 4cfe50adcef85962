"""Flight, measured: tracking on `hoop6` beside rotorpy's controller, and the time of a campaign beside rotorpy's for one run.

Run as `python tests/benchmarks/flight.py [--runs 1000] [--workers 2]`; rotorpy comes with the `benchmark` extra. With `--on-board` only
the campaign of flights of 30 s with Mellinger's controller and the filter on board is flown and timed; with `--firmware` only what the
compiled firmware gave on a flight is held against what is simulated of it.
"""

from __future__ import annotations

import argparse
import resource
import sys
import time
import warnings
from pathlib import Path

import numpy as np

if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import flight
from flight.closed_loop import Setup, steps
from flight.model.airframe import Airframe, airframe_of
from flight.model.reference import sample_reference
from flight.model.timing import CONTROL_STEP, SUBSTEPS
from tests.helpers.benchmarks import installed, run_benchmark
from tests.helpers.motion.stand_ins import StandIn, hoop6
from tests.helpers.vehicles.firmware_flights import flown_here
from verify.data import Plan, Trajectory, load_vehicle

FLIGHT_TIME = 30.0
"""s; the firefighting flight is slowed down to this, so that costs compare with those of a flight of that length."""


def tracking(speed: float, **conditions) -> tuple[float, float]:
    """Return our RMS and worst error in mm on hoop6."""
    reference = sample_reference({"quad0": hoop6(speed)}, CONTROL_STEP, SUBSTEPS)
    setup = Setup((airframe_of(load_vehicle("crazyflie-2.1")),), reference, flight.Conditions(**conditions))
    errors = np.array([np.linalg.norm(s.position[:, 0] - reference.fine[s.step, :, 0]) for s in steps(setup, [0])])
    return 1000 * float(np.sqrt(np.mean(errors**2))), 1000 * float(np.max(errors))


class _Plan:
    """A trajectory as rotorpy asks for it."""

    def __init__(self, path: Trajectory) -> None:
        self.path = path

    def update(self, t: float) -> dict:
        flat = [self.path.evaluate(t, order) for order in range(5)]
        names = ("x", "x_dot", "x_ddot", "x_dddot", "x_ddddot")
        return {
            **{n: f[:3] for n, f in zip(names, flat, strict=True)},
            "yaw": flat[0][3],
            "yaw_dot": flat[1][3],
            "yaw_ddot": flat[2][3],
        }


def rotorpy_run(path: Trajectory, steps_a_command: int) -> tuple[float, float, float]:
    """Fly a path in rotorpy with its own SE(3) controller and Crazyflie, 50 Hz attitude commands.

    Returns:
        RMS and worst error in mm, and the time it took in s.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        from rotorpy.controllers.quadrotor_control import SE3Control
        from rotorpy.vehicles.crazyflie_params import quad_params
        from rotorpy.vehicles.multirotor import Multirotor
    begin = time.perf_counter()
    start = path.evaluate(0.0)[:3]
    hover = np.sqrt(quad_params["mass"] * 9.81 / 4 / quad_params["k_eta"])
    state = {
        "x": start,
        "v": np.zeros(3),
        "q": np.array([0.0, 0, 0, 1]),
        "w": np.zeros(3),
        "wind": np.zeros(3),
        "rotor_speeds": np.full(4, hover),
    }
    vehicle, controller, plan = (
        Multirotor(quad_params, state, control_abstraction="cmd_ctatt"),
        SE3Control(quad_params),
        _Plan(path),
    )
    errors = []
    for tick in range(int(path.duration / CONTROL_STEP)):
        command = controller.update(tick * CONTROL_STEP, state, plan.update(tick * CONTROL_STEP))
        for _ in range(steps_a_command):
            state = vehicle.step(state, command, CONTROL_STEP / steps_a_command)
        errors.append(np.linalg.norm(state["x"] - path.evaluate((tick + 1) * CONTROL_STEP)[:3]))
    elapsed = time.perf_counter() - begin
    return 1000 * float(np.sqrt(np.mean(np.square(errors)))), 1000 * float(np.max(errors)), elapsed


def rotorpys_crazyflie() -> Airframe:
    """Our model with the numbers of rotorpy's Crazyflie in it, so that both fly the same vehicle."""
    vehicle = load_vehicle("crazyflie-2.1").model_copy(
        update={
            "mass": 0.03, "inertia": (1.43e-5, 1.43e-5, 2.89e-5), "arm": 0.043, "torque_to_thrust": 7.8e-10 / 2.3e-8,
            "rotor_thrust_min": 0.0, "rotor_thrust_max": 2.3e-8 * 2500**2, "thrust_min": 0.01, "thrust_max": 4 * 2.3e-8 * 2500**2,
        }
    )  # fmt: skip
    return airframe_of(load_vehicle("crazyflie-2.1")).model_copy(update={"vehicle": vehicle, "rotor_inertia": 0.0})


def firefighting() -> tuple[Plan, dict[str, Trajectory]]:
    """The shipped mission's plan and trajectories, slowed down to `FLIGHT_TIME`."""
    import ltlplan
    import refine

    plan = ltlplan.plan(ltlplan.load_mission("firefighting"))
    team = refine.refine(plan)
    slower = FLIGHT_TIME / max(path.duration for path in team.values())
    return plan, {n: Trajectory(p.durations * slower, p.coefficients / slower ** np.arange(8)) for n, p in team.items()}


def step_responses() -> None:
    """Print how each vehicle answers a step of 0.3 m along x, 0.2 m along y and z, and 0.6 rad of heading."""
    from tests.flight.control.test_control import STEPS, response

    print("\nstep responses of the geometric controller: overshoot, time to stay within 10 % (s)")
    print(f"{'':<30} {'0.3 m in x':>16} {'0.2 m in y, z':>16} {'0.6 rad heading':>16}")
    for name in flight.shipped_airframes():
        times, place, yaw = response(name, STEPS, seconds=4.0)
        cells = []
        for k, (jump, turn) in enumerate(STEPS):
            goal = np.array(jump)
            done = yaw[:, k] / turn if turn else place[:, :, k] @ goal / (goal @ goal)
            away = np.abs(done - 1.0) if turn else np.linalg.norm(place[:, :, k] - goal, axis=1) / np.linalg.norm(goal)
            cells.append(f"{100 * max(float(np.max(done)) - 1.0, 0.0):.0f} %, {times[np.flatnonzero(away > 0.1)[-1]]:.2f}")
        print(f"{name:<30} {cells[0]:>16} {cells[1]:>16} {cells[2]:>16}")


def _cpu() -> float:
    """Processor time of this process and of those that it has waited for, s."""
    used = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return sum(usage.ru_utime + usage.ru_stime for usage in used)


def timed_campaign(team: dict[str, Trajectory], plan: Plan, options: argparse.Namespace, **conditions) -> flight.Campaign:
    """Fly a campaign of the options' runs on the options' processes, say what it took, and return what it found."""
    begin, cpu = time.perf_counter(), _cpu()
    found = flight.campaign(plan, team, runs=options.runs, workers=options.workers, **conditions)
    elapsed, cpu = time.perf_counter() - begin, _cpu() - cpu
    print(f"{options.runs} runs on {options.workers} processes: {elapsed:.1f} s; {cpu:.1f} s of processor time")
    return found


def on_board(options: argparse.Namespace) -> None:
    """Time flights of `FLIGHT_TIME` with the controller and the estimator of common firmware, and print what they found."""
    plan, team = firefighting()
    conditions = flight.conditions_of(plan.mission).changed(controller="mellinger")
    print(f"firefighting, {len(team)} robots, {FLIGHT_TIME:g} s of flight, 500 Hz; {conditions.sentence}")
    print(*timed_campaign(team, plan, options, conditions=conditions).sentences, sep="\n")


def against_firmware() -> None:
    """Print RMS and worst error of the firmware's flights, the firmware's first."""
    print(f"{'hoops-sequence, RMS and worst error in mm':<56} {'firmware':>10} {'here':>14}")
    for one, rms, worst in flown_here():
        print(f"{one.name:<56} {one.rms:4g}, {one.worst:4g} {rms:7.1f}, {worst:5.1f}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=1000)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--on-board", action="store_true")
    parser.add_argument("--firmware", action="store_true")
    options = parser.parse_args()
    if options.firmware:
        against_firmware()
        return
    if options.on_board:
        on_board(options)
        return
    print("hoop6, errors in mm                                        1 m/s RMS  worst   0.45 m/s RMS  worst")
    reference = {speed: sample_reference({"quad0": hoop6(speed)}, CONTROL_STEP, SUBSTEPS) for speed in (1.0, 0.45)}

    def row(name: str, results: list[tuple[float, float]]) -> None:
        print(f"{name:<58} {results[0][0]:8.1f} {results[0][1]:7.1f} {results[1][0]:13.1f} {results[1][1]:6.1f}")

    same = rotorpys_crazyflie()
    ours = []
    for made in reference.values():
        errors = np.array(
            [np.linalg.norm(s.position[:, 0] - made.fine[s.step, :, 0]) for s in steps(Setup((same,), made), [0])]
        )
        ours.append((1000 * float(np.sqrt(np.mean(errors**2))), 1000 * float(np.max(errors))))
    row("geometric, rotorpy's Crazyflie, perfect state", ours)
    row("geometric, our Crazyflie 2.1, perfect state", [tracking(speed) for speed in (1.0, 0.45)])
    noisy = {"noise": flight.MotionCapture(), "wind": flight.Wind((0.5, 0.0, 0.0), 0.3)}
    row("geometric, motion capture, wind 0.5 m/s with gusts 0.3", [tracking(speed, **noisy) for speed in (1.0, 0.45)])
    row("the papers' controller, full model", [tracking(speed, controller="paper") for speed in (1.0, 0.45)])
    row("the papers' controller, the papers' model", [tracking(s, controller="paper", model="paper") for s in (1.0, 0.45)])
    peer = float("nan")
    if installed("rotorpy", "rotorpy"):
        for count in (1, 10):
            row(
                f"rotorpy, its SE(3) controller, {50 * count} Hz attitude loop",
                [rotorpy_run(hoop6(s), count)[:2] for s in (1.0, 0.45)],
            )
        peer = rotorpy_run(hoop6(8.7 / FLIGHT_TIME), 10)[2]
    step_responses()
    plan, team = firefighting()
    conditions = {"wind": "0.5+0.3", "noise": 0.001}
    begin = time.perf_counter()
    cert = StandIn(plan.mission, {name: path.digest() for name, path in team.items()})
    log = flight.fly(plan, team, cert, **conditions)
    single = time.perf_counter() - begin
    print(
        f"\nfirefighting, {len(team)} robots, {FLIGHT_TIME:g} s of flight, 500 Hz dynamics, 50 Hz control, wind, gusts, motion capture"
    )
    print(f"one flight with monitor and log: {single:.1f} s ({len(log)} entries)")
    found = timed_campaign(team, plan, options, **conditions)
    print(
        f"rotorpy, one robot, one run of {FLIGHT_TIME:g} s at 500 Hz: {peer:.1f} s; {len(team)} robots: {len(team) * peer:.1f} s"
    )
    print(*found.sentences, sep="\n")


def test_benchmark(capsys) -> None:
    """Runs a small campaign, so that `pytest tests/benchmarks/flight.py -s` prints the table."""
    with capsys.disabled():
        sys.argv = ["flight.py", "--runs", "20", "--workers", "1"]
        main()
    assert tracking(1.0)[0] <= 30.0


if __name__ == "__main__":
    run_benchmark(main, ["--runs", "1", "--workers", "1"], ["--on-board", "--runs", "1", "--workers", "1"], ["--firmware"])
