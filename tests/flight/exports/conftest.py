"""A certified team to export, and scripts that fly exports with crazyswarm2."""

from __future__ import annotations

import importlib.util
import signal
import sys

import pytest

import flight
from tests.helpers.motion.stand_ins import flight as made_flight
from tests.helpers.motion.stand_ins import stand_in
from tests.helpers.vehicles.crazyswarm_peer import Robot, World


@pytest.fixture(scope="module")
def certified():
    plan, team = made_flight()
    team = flight.with_hovers(team)
    return team, stand_in(plan, team)


@pytest.fixture
def script_in_world(tmp_path, monkeypatch):
    """Export a team; return robots that stand below their starts, and the script that flies them."""

    def forget() -> None:
        """Have what was copied beside one script not be taken for what lies beside another."""
        for name in [name for name in sys.modules if name == "flying" or name.startswith("flying.")]:
            del sys.modules[name]

    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}

    def make(team, cert, world=None, kind=Robot):
        flight.export(team, cert, tmp_path, force=True)
        world = world or World()
        for name, path in team.items():
            world.robots[name] = kind(name, world, path.evaluate(0.0)[:3] * (1, 1, 0))
        for name, module in world.modules().items():
            monkeypatch.setitem(sys.modules, name, module)
        forget()
        monkeypatch.syspath_prepend(tmp_path)
        spec = importlib.util.spec_from_file_location("fly_mission", tmp_path / "fly_mission.py")
        script = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(script)
        return world, script

    yield make
    forget()
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.fixture
def world_and_script(certified, script_in_world):
    """The exported script, and robots that stand below their starts."""
    return script_in_world(*certified)
