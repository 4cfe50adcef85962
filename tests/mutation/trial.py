"""Plant faults in the loaded judge, each in a process of its own, and run the tests that reach it until one fails.

Tests are collected once. A first child process runs all of them and notes which functions each one enters; then for every
fault a child is forked, its function's code is replaced, and the tests that enter the function run, quick ones first. A fault
outside of functions is planted while its module is loaded, in a new process.
"""

from __future__ import annotations

import ast
import functools
import gc
import importlib
import json
import math
import multiprocessing
import os
import resource
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from types import CodeType, FrameType, FunctionType
from typing import Any

import pytest
from _pytest.runner import runtestprotocol

from tests.mutation.sites import ROOT, Fault, plant

TESTS = ("tests/verify", "tests/test_end_to_end.py")
"""The judge's own tests."""

SECONDS = 120.0
"""How much processor time the tests of one fault may take; a fault that is not noticed by then survives."""


@dataclass(frozen=True, slots=True)
class Finding:
    """What became of a fault.

    Attributes:
        fault: What was planted.
        noticed: The test that failed; "hangs" where tests ran far longer than without the fault; empty where it survives.
        tried: How many tests ran.
    """

    fault: Fault
    noticed: str
    tried: int


@dataclass(frozen=True, slots=True)
class Reach:
    """What one test enters.

    Attributes:
        seconds: How long it takes.
        functions: "path:first line" of every function of the judge that it enters.
    """

    seconds: float
    functions: frozenset[str]


def try_faults(
    drawn: Iterable[Fault], *, jobs: int = 1, seconds: float = SECONDS, told: Callable[[Finding], None] = lambda _: None
) -> list[Finding]:
    """Plant each fault and say which test notices it.

    Args:
        drawn: The faults.
        jobs: How many processes work at once.
        seconds: Processor time for the tests of one fault, in s.
        told: Called with each finding as it is made.
    """
    runner = _Runner(list(drawn), jobs, seconds, told)
    arguments = ["-q", "-n", "0", "-p", "no:cacheprovider", "--hypothesis-seed=0", "--no-header", *TESTS]
    os.chdir(ROOT)
    pytest.main(arguments, plugins=[runner])
    return runner.findings


class _Runner:
    """A pytest plugin that takes over once the tests are collected."""

    def __init__(self, drawn: list[Fault], jobs: int, seconds: float, told: Callable[[Finding], None]) -> None:
        self.drawn, self.jobs, self.seconds, self.told = drawn, jobs, seconds, told
        self.findings: list[Finding] = []

    def pytest_runtestloop(self, session: pytest.Session) -> bool:
        gc.unfreeze()  # what the tests' set-up hid from the collector is looked up there
        reach = _in_parallel([functools.partial(_reach, part) for part in _parts(session.items, self.jobs)], self.jobs)
        table = {name: Reach(entry[0], frozenset(entry[1])) for part in reach for name, entry in part.items()}
        works = [functools.partial(_try, fault, _suspects(session.items, table, fault), self.seconds) for fault in self.drawn]
        found: dict[int, Finding] = {}

        def note(index: int, answer: tuple[str, int]) -> None:
            found[index] = Finding(self.drawn[index], *answer)
            self.told(found[index])

        _in_parallel(works, self.jobs, limit=4 * self.seconds, told=note)
        self.findings += [found[index] for index in sorted(found)]
        return True


def _parts(items: list[pytest.Item], count: int) -> list[list[pytest.Item]]:
    """Split tests into parts that keep a module's tests together."""
    modules: dict[str, list[pytest.Item]] = {}
    for item in items:
        modules.setdefault(str(item.path), []).append(item)
    parts: list[list[pytest.Item]] = [[] for _ in range(count)]
    for index, module in enumerate(modules.values()):
        parts[index % count] += module
    return parts


def _suspects(items: list[pytest.Item], table: dict[str, Reach], fault: Fault) -> list[pytest.Item]:
    """Return the tests that may notice a fault, a module's together: those of its own module first, then quick modules."""
    if not fault.function:
        return items
    entered = f"{fault.path}:{_first_line(plant(fault), fault)}"
    chosen = [item for item in items if item.nodeid in table and entered in table[item.nodeid].functions]
    own = f"test_{Path(fault.path).stem}"
    modules: dict[str, list[pytest.Item]] = {}
    for item in chosen:
        modules.setdefault(str(item.path), []).append(item)

    def order(path: str) -> tuple[bool, float]:
        return Path(path).stem != own, sum(table[item.nodeid].seconds for item in modules[path])

    return [item for path in sorted(modules, key=order) for item in modules[path]]


def _reach(items: list[pytest.Item]) -> dict[str, tuple[float, list[str]]]:
    """Run tests and note how long each takes and what it enters."""
    judge = str(ROOT / "verify") + os.sep
    known: dict[CodeType, str | None] = {}
    result: dict[str, tuple[float, list[str]]] = {}
    path: Path | None = None
    for item, following in zip(items, [*items[1:], None], strict=True):
        if item.path != path:  # what an earlier module's tests computed would not be entered again
            _forget()
            path = item.path
        entered: set[str] = set()

        def note(frame: FrameType, event: str, _: object, entered: set[str] = entered) -> None:
            code = frame.f_code
            if code not in known:
                inside = code.co_filename.startswith(judge)
                path = os.path.relpath(code.co_filename, ROOT) if inside else ""
                known[code] = f"{path}:{code.co_firstlineno}" if inside else None
            name = known[code]
            if name is not None:
                entered.add(name)

        begun = time.process_time()
        sys.settrace(note)  # pyright: ignore[reportArgumentType]  no local tracer: functions' lines do not matter
        try:
            passed = _passes(item, following)
        finally:
            sys.settrace(None)
        if passed:
            result[item.nodeid] = (time.process_time() - begun, sorted(entered))
    return result


def _passes(item: pytest.Item, following: pytest.Item | None) -> bool:
    return not any(report.failed for report in runtestprotocol(item, log=False, nextitem=following))


def _try(fault: Fault, items: list[pytest.Item], seconds: float) -> tuple[str, int]:
    """Plant a fault in this process, or in a new one, and run tests until one fails."""
    if not items:
        return "", 0
    if not fault.function:
        return _try_anew(fault, items)
    _replace(fault)
    _forget()
    begun = time.process_time()
    for number, (item, following) in enumerate(zip(items, [*items[1:], None], strict=True), 1):
        if not _passes(item, following):
            return item.nodeid, number
        if time.process_time() - begun > seconds:
            return "", number
    return "", len(items)


def _forget() -> None:
    """Empty all caches of functions, so that what was computed before is computed again."""
    for value in gc.get_objects():
        if isinstance(value, functools._lru_cache_wrapper):
            value.cache_clear()


def _replace(fault: Fault) -> None:
    """Give the function that holds a fault the code with the fault; shapes and their like are loaded only where they are named."""
    importlib.import_module(fault.module)
    tree = plant(fault)
    path = str(ROOT / fault.path)
    first = _first_line(tree, fault)
    module = compile(tree, path, "exec")
    codes = [code for code in _codes(module) if code.co_firstlineno == first and code.co_name == fault.function.split(".")[-1]]
    found = [
        value
        for value in gc.get_objects()
        if isinstance(value, FunctionType) and value.__code__.co_filename == path and value.__code__.co_firstlineno == first
        and value.__code__.co_name == fault.function.split(".")[-1]
    ]  # fmt: skip
    assert len(codes) == 1, fault.name
    assert found, fault.name
    for function in found:
        function.__code__ = codes[0]


def _first_line(tree: ast.Module, fault: Fault) -> int:
    """Return the line on which the function that holds a fault begins, decorators included."""
    bodies: list[ast.stmt] = tree.body
    found: ast.AST = tree
    for name in fault.function.split("."):
        named = [node for node in bodies if isinstance(node, ast.FunctionDef | ast.ClassDef) and node.name == name]
        spans = [node for node in named if node.lineno <= fault.line <= (node.end_lineno or 0)] or named
        found, bodies = spans[0], spans[0].body
    assert isinstance(found, ast.FunctionDef | ast.ClassDef)
    return min([found.lineno, *(decorator.lineno for decorator in found.decorator_list)])


def _codes(code: CodeType) -> Iterable[CodeType]:
    for value in code.co_consts:
        if isinstance(value, CodeType):
            yield value
            yield from _codes(value)


_PLANTED = """
import importlib.machinery, importlib.util, sys
import pytest
from tests.mutation.sites import Fault, ROOT, plant

fault = Fault({fields})
planted = []

class Loader(importlib.machinery.SourceFileLoader):
    def get_code(self, name):
        planted.append(name)
        return compile(plant(fault), self.path, "exec")

class Finder:
    @staticmethod
    def find_spec(name, path=None, target=None):
        if name != fault.module:
            return None
        file = str(ROOT / fault.path)
        return importlib.util.spec_from_file_location(name, file, loader=Loader(name, file))

sys.meta_path.insert(0, Finder)
ended = pytest.main(["-x", "-q", "-n", "0", "-p", "no:cacheprovider", "--hypothesis-seed=0", "--no-header", *{tests!r}])
sys.exit(ended if planted else 3)
"""


def _try_anew(fault: Fault, items: list[pytest.Item]) -> tuple[str, int]:
    """Load everything in a new process, with a fault outside of functions, and run all tests."""
    fields = ", ".join(f"{name}={getattr(fault, name)!r}" for name in fault.__slots__)
    program = _PLANTED.format(fields=fields, tests=list(dict.fromkeys(item.nodeid.split("::")[0] for item in items)))
    done = subprocess.run([sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True, check=False)
    if done.returncode == 0:
        return "", len(items)
    if done.returncode == -signal.SIGXCPU:
        return "hangs", 0
    if done.returncode not in (1, 2, 4):  # tests failed; one could not be loaded; `conftest.py` could not
        raise RuntimeError(f"{fault.name} was not tried:\n{done.stdout[-2000:]}{done.stderr[-2000:]}")
    failed = [line for line in done.stdout.splitlines() if line.startswith(("FAILED", "ERROR"))]
    return (failed[0] if failed else (done.stdout.strip().splitlines() or [f"ends with {done.returncode}"])[-1]), 0


def _in_parallel(
    works: list[Callable[[], Any]], jobs: int, limit: float | None = None, told: Callable[[int, Any], None] | None = None
) -> list[Any]:
    """Run each work in a forked child, some at once.

    Args:
        works: Each returns what JSON can hold.
        jobs: How many at once.
        limit: Processor time of one, in s, and a tenth of what it may last; None for no limit.
        told: Called with the index and the answer of each as it ends.

    Returns:
        The answers; ("hangs", 0) where one met the limit, ("", 0) where it died otherwise.
    """
    context = multiprocessing.get_context("fork")
    answers: list[Any] = [None] * len(works)
    waiting = list(enumerate(works))
    running: dict[int, tuple[Any, Path, float]] = {}
    with tempfile.TemporaryDirectory() as folder:
        while waiting or running:
            while waiting and len(running) < jobs:
                index, work = waiting.pop(0)
                answer = Path(folder) / str(index)
                child = context.Process(target=_answer, args=(work, answer, limit))
                child.start()
                running[index] = (child, answer, time.monotonic())
            time.sleep(0.02)
            for index, (child, answer, begun) in list(running.items()):
                late = limit is not None and time.monotonic() - begun > 10 * limit
                if child.is_alive() and not late:
                    continue
                if child.is_alive():
                    os.kill(child.pid, signal.SIGKILL)
                child.join()
                late = late or child.exitcode == -signal.SIGXCPU
                answers[index] = json.loads(answer.read_text()) if answer.exists() else ("hangs" if late else "", 0)
                del running[index]
                if told is not None:
                    told(index, answers[index])
    return answers


def _answer(work: Callable[[], Any], path: Path, limit: float | None) -> None:
    if limit is not None:
        resource.setrlimit(resource.RLIMIT_CPU, (math.ceil(limit), resource.getrlimit(resource.RLIMIT_CPU)[1]))
    value = work()
    part = path.with_suffix(".part")
    part.write_text(json.dumps(value))
    part.replace(path)
