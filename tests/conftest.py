"""What many tests share and takes seconds to make: runs of the shipped missions, and pages of one of them.

Tests run in several processes; what is made here is made by the first that asks for it, and read by the others.
"""

from __future__ import annotations

import contextlib
import fcntl
import functools
import gc
import importlib
import os
import pickle
import shutil
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, settings

import ltlplan

Once = Callable[[str, Callable[[Path], Any]], Any]

# Dozens of processes are started: without what the first has compiled, each would compile all sources anew.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False
# More processes than processors are at work: threads of linear algebra that wait for each other only take time from them.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
# Whether an example takes long is the machine's affair: a test must not fail because others are at work.
settings.register_profile("few", deadline=None, suppress_health_check=[HealthCheck.too_slow], max_examples=15)
settings.register_profile("many", settings.get_profile("few"), max_examples=400)
settings.load_profile("few")


gc.disable()  # nearly all that is made until the tests begin stays to the end


def pytest_configure(config: pytest.Config) -> None:
    """Draw many cases for laws that name no number of their own, where the slow tests run."""
    if config.getoption("markexpr") == "slow":
        settings.load_profile("many")


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Run laws of hypothesis with the slow tests, too: by default they are held to few cases."""
    if config.getoption("markexpr") == "slow":
        for item in items:
            if getattr(getattr(item, "obj", None), "is_hypothesis_test", False):
                item.add_marker("slow")


@pytest.hookimpl(tryfirst=True)
def pytest_collection(session: pytest.Session) -> None:
    """Have each process of a whole run load the tests from another place on: what one has compiled the others need not compile."""
    process, of = (os.environ.get(f"PYTEST_XDIST_WORKER{end}", "") for end in ("", "_COUNT"))
    if process and session.config.args == session.config.getini("testpaths"):
        tests = Path(__file__).parent
        names = [".".join(path.relative_to(tests.parent).with_suffix("").parts) for path in sorted(tests.rglob("test_*.py"))]
        first = len(names) * int(process.removeprefix("gw")) // int(of)
        for name in names[first:] + names[:first]:
            with contextlib.suppress(Exception, pytest.skip.Exception):  # told when it is collected
                importlib.import_module(name)


def pytest_collection_finish() -> None:
    """Let the garbage collector pass over what was collected and imported, which stays to the end: it is looked through no more."""
    gc.freeze()
    gc.set_threshold(20_000, 20, 50)  # formulas and syntax trees are many small values, of which few are garbage
    gc.enable()


@pytest.fixture(params=["nominal", pytest.param(0.7, marks=pytest.mark.slow)])
def pace(request: pytest.FixtureRequest) -> float | str:
    """Return the pace of flights that are no subject of a test: nominal, and the default one with the slow tests."""
    return request.param


@pytest.fixture(scope="session")
def once(tmp_path_factory: pytest.TempPathFactory) -> Once:
    """Return a way to make a value once in all processes of a run; its maker is given the path of a folder that is all its own."""
    base = tmp_path_factory.getbasetemp()
    shared = (base.parent if "PYTEST_XDIST_WORKER" in os.environ else base) / "shared"

    def made(name: str, make: Callable[[Path], Any]) -> Any:
        place = shared / name
        place.mkdir(parents=True, exist_ok=True)
        value = place / "value"
        with (place / "lock").open("w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            if not value.exists():
                found = make(place / "made")
                (place / "new").write_bytes(pickle.dumps(found))
                (place / "new").rename(value)
            fcntl.flock(lock, fcntl.LOCK_UN)  # a process that was forked meanwhile may have the file open for long
        return pickle.loads(value.read_bytes())

    return made


@pytest.fixture(scope="session")
def shipped_run(once: Once) -> Callable[[str], ltlplan.Result]:
    """Return the run of a shipped mission, with its files; what is there is for reading."""
    return functools.cache(
        lambda name: once(f"run of {name}", lambda folder: ltlplan.run(ltlplan.load_mission(name), folder / name))
    )


@pytest.fixture(scope="session")
def shipped_folder(shipped_run: Callable[[str], ltlplan.Result]) -> Callable[[str], Path]:
    """Return the folder of the run of a shipped mission, for reading."""
    return lambda name: next(path.parent for path in shipped_run(name).files if path.name == "mission.yaml")


@pytest.fixture(scope="session")
def shipped_page(once: Once, shipped_run: Callable[[str], ltlplan.Result]) -> Callable[[str], str]:
    """Return a page by its name, `report`, `show`, `campaign` or `online`, of the firefighting mission."""

    def made(name: str) -> str:  # most runs of a few tests need none of these libraries
        from flight.campaigns import campaign
        from ltlplan.online.simulated_online_flight import fly_online
        from ltlplan.report.campaign import campaign_html
        from ltlplan.report.online import online_html
        from ltlplan.report.pictures import pictures_html
        from ltlplan.report.run_page import report_html
        from verify.data.events import HoopMoves

        mission = ltlplan.load_mission("firefighting")
        if name == "report":
            return report_html(shipped_run("firefighting"))
        if name == "show":
            return pictures_html(mission)
        if name == "online":
            moves = HoopMoves(time=3.0, region="water", center=(0.3, -0.7, 0.9))
            return online_html(fly_online(mission, seed=0, events=[moves]))
        run = shipped_run("firefighting")
        return campaign_html(campaign(run.plan, run.team, run.certificate, runs=3, seed=0, wind="1.0+0.4"))

    return functools.cache(lambda name: once(f"page {name}", lambda _folder: made(name)))


@pytest.fixture(scope="session")
def proofs(once: Once) -> tuple[Path, dict[str, set[str]]]:
    """Return the folder in which the proofs in Coq are built, and the axioms of each theorem."""
    if shutil.which("coqc") is None:
        pytest.skip("needs Coq: apt-get install coq")
    from tests.helpers.kernel.proved_checkers import build_proofs

    return once("proofs in Coq", lambda folder: (folder, build_proofs(folder)))


@pytest.fixture(scope="session")
def checkers(once: Once, proofs: tuple[Path, dict[str, set[str]]]) -> Path:
    """Return the program that was extracted from the proofs."""
    if shutil.which("ocamlfind") is None or shutil.which("ocamlopt") is None:
        pytest.skip("needs OCaml: apt-get install ocaml-nox ocaml-findlib")
    from tests.helpers.kernel.proved_checkers import build_checkers

    return once("extracted checkers", lambda _folder: build_checkers(proofs[0]))
