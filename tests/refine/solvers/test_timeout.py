"""A clock that runs out ends the run with an error, or leaves a note where another flight is there that holds."""

from __future__ import annotations

import numpy as np
import pytest

import refine
import verify
from refine import Limits, SolverTimeout, minimum_snap, time_optimal
from refine.single_robot import time_optimised
from refine.solvers import nlp, qp, retiming
from tests.helpers.motion.plans_by_hand import patrol_plan, sequence_plan
from verify.data import Infeasible, LtlplanError

POINTS = np.array([[0.0, 0.0, 1.0], [1.0, 0.5, 1.2], [2.0, -0.5, 1.0], [3.0, 0.0, 1.4]])
LIMITS = Limits(speed=2.0, thrust_max=15.0)


def test_ipopts_clock_is_an_error_and_no_fallback(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(nlp, "SECONDS", 1e-3)
    with pytest.raises(SolverTimeout, match=r"IPOPT did not finish within its 0\.001 s") as caught:
        time_optimal(POINTS, LIMITS)
    assert (caught.value.engine, caught.value.seconds, caught.value.exit_code) == ("IPOPT", 1e-3, 4)


def test_where_ipopts_clock_runs_out_the_best_flight_so_far_stands_with_a_note(monkeypatch: pytest.MonkeyPatch) -> None:
    plan, said = patrol_plan(), list[str]()
    monkeypatch.setattr(nlp, "SECONDS", 1e-3)
    time_optimised.forget()
    team, nominal = refine.refine(plan, pace="time", note=said.append), refine.refine(plan, pace="nominal")
    time_optimised.forget()  # other tests have time
    assert verify.judge(plan, team, largest=False).holds
    assert max(flight.duration for flight in team.values()) < max(flight.duration for flight in nominal.values())
    assert any("IPOPT did not finish within its 0.001 s" in sentence for sentence in said)


def test_a_time_out_is_an_error_of_ours_and_no_kind_of_infeasibility() -> None:
    assert issubclass(SolverTimeout, LtlplanError)
    assert not issubclass(SolverTimeout, Infeasible)


def test_osqps_clock_is_an_error_and_no_fallback(monkeypatch: pytest.MonkeyPatch) -> None:
    """It is asked where non-negative least squares runs out of steps."""
    usual = refine.refine(sequence_plan(), pace="nominal")["quad0"]

    def out_of_steps(_matrix: np.ndarray, _target: np.ndarray) -> None:
        raise RuntimeError("Maximum number of iterations reached.")

    monkeypatch.setattr(qp, "nnls", out_of_steps)
    flight = refine.refine(sequence_plan(), pace="nominal")["quad0"]
    np.testing.assert_allclose(flight.durations, usual.durations, rtol=1e-3)
    np.testing.assert_allclose(flight.evaluate(flight.knots), usual.evaluate(usual.knots), atol=1e-2)
    monkeypatch.setattr(qp, "SECONDS", 1e-9)
    with pytest.raises(SolverTimeout, match="OSQP"):
        refine.refine(sequence_plan())


def test_clarabels_clock_and_its_iterations_are_told_apart(monkeypatch: pytest.MonkeyPatch) -> None:
    path = minimum_snap(POINTS, [0.0, 1.0, 2.0, 3.0])
    monkeypatch.setattr(retiming, "SECONDS", 1e-9)
    with pytest.raises(SolverTimeout, match="Clarabel"):
        retiming.pace(path, LIMITS)
    monkeypatch.setattr(retiming, "SECONDS", 120.0)
    monkeypatch.setattr(retiming, "ITERATIONS", 2)
    with pytest.raises(Infeasible, match="after at most 2 iterations") as caught:
        retiming.pace(path, LIMITS)
    assert not isinstance(caught.value, SolverTimeout)
    monkeypatch.undo()
    assert np.all(np.diff(retiming.pace(path, LIMITS)) > 0)
