"""Computing elements anew, in processes whose linear algebra is the same on every x86-64 processor.

OpenBLAS and numpy choose kernels by processor, and these round the last digit otherwise, so that cross-entropy ends at another path. The
processes are started with the kernels that each such processor of the last ten years has.
"""

from __future__ import annotations

import os
import platform
import threading
import time
from collections.abc import Generator, Mapping, Sequence
from concurrent.futures import as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import groupby

from flight.processes import Processes
from ltlplan.reproduction.element import Element, Findings, Quantity
from ltlplan.reproduction.expectation import Expectation
from ltlplan.reproduction.intervals import expectations_of
from verify.data import BadInput, LtlplanError
from verify.data.progress import Progress, silent

KERNELS: Mapping[str, str] = {
    "OMP_NUM_THREADS": "1",
    "OPENBLAS_CORETYPE": "Haswell",
    "NPY_DISABLE_CPU_FEATURES": "X86_V4 AVX512_ICL AVX512_SPR",
}
"""Environment of the processes."""

_LONGEST = (
    "2022-fig-14",
    "published-bosch",
    "published-door-puzzle",
    "published-schillinger-third",
    "published-schillinger-second",
    "published-doorpuzzle-1",
    "2019-fig-4",
)
"""Elements that take longest, which begin first."""


_Found = tuple[Findings, float, str]
"""What was found of an element, the processor time in s, and why it failed."""


@dataclass(frozen=True, slots=True)
class Judged:
    """A quantity beside what is expected of it.

    Attributes:
        quantity: As computed.
        expected: The reviewed interval, text or check.
        inside: Whether it is as expected.
    """

    quantity: Quantity
    expected: Expectation
    inside: bool


@dataclass(frozen=True, slots=True)
class Rerun:
    """An element after it was computed.

    Attributes:
        element: Which.
        findings: What was found; empty where it failed.
        seconds: Processor time, s.
        fault: Why it failed; empty where it did not.
    """

    element: Element
    findings: Findings
    seconds: float
    fault: str = ""

    @property
    def judged(self) -> tuple[Judged, ...]:
        """Each quantity beside its expectation."""
        expected = expectations_of(self.element.id)
        found = ((quantity, expected(quantity)) for quantity in self.findings.quantities)
        return tuple(Judged(quantity, wanted, wanted.admits(quantity.ours)) for quantity, wanted in found)

    @property
    def outside(self) -> tuple[Judged, ...]:
        """The quantities that are not as expected."""
        return tuple(each for each in self.judged if not each.inside)

    @property
    def fine(self) -> bool:
        """True if it was computed, and all is as expected."""
        return not self.fault and not self.outside


def rerun(elements: Sequence[Element], *, workers: int, progress: Progress = silent) -> tuple[Rerun, ...]:
    """Compute elements anew in processes of this machine and return what was found, in their order.

    Args:
        elements: Which.
        workers: Processes.
        progress: Receives a sentence and the share done, 0 to 1.

    Raises:
        BadInput: A process was ended from outside.
    """
    groups = [[each.id for each in group] for _, group in groupby(sorted(elements, key=_group), key=_group)]
    groups.sort(key=lambda ids: next((_LONGEST.index(each) for each in ids if each in _LONGEST), len(_LONGEST)))
    found: dict[str, _Found] = {}
    busy: dict[int, str] = {}
    over: set[int] = set()

    def tell() -> None:
        progress(
            f"{len(found)} of {len(elements)} elements done; now {' and '.join(busy.values()) or 'the page'}",
            len(found) / len(elements),
        )

    def noting(index: int) -> Progress:
        def note(sentence: str, _share: float) -> None:
            if sentence and index not in over:
                busy[index] = sentence
                tell()

        return note

    with _pinned(), Processes(min(workers, len(groups))) as processes:
        futures = {processes.submit(_computed, ids, progress=noting(index)): index for index, ids in enumerate(groups)}
        try:
            for future in as_completed(futures):
                found |= future.result()
                over.add(futures[future])
                busy.pop(futures[future], None)
                tell()
        except BrokenProcessPool:
            raise BadInput("a process was ended by the system, perhaps for want of memory; run it again.") from None
    return tuple(Rerun(element, *found[element.id]) for element in elements)


def _group(element: Element) -> str:
    return element.shares or element.id


@contextmanager
def _pinned() -> Generator[None]:
    """Let processes that are started meanwhile have the kernels that all x86-64 processors of the last ten years have."""
    if platform.machine() not in ("x86_64", "AMD64"):
        yield
        return
    before = {name: os.environ.get(name) for name in KERNELS}
    os.environ.update(KERNELS)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


def _computed(ids: Sequence[str], progress: Progress) -> dict[str, _Found]:
    """Compute elements one after another, in a process of its own."""
    from ltlplan.reproduction.elements import ELEMENTS

    chosen = {element.id: element for element in ELEMENTS if element.id in ids}
    found: dict[str, _Found] = {}
    with _ending(progress):
        for index, (name, element) in enumerate(chosen.items()):
            progress(name, index / len(chosen))
            begun = time.process_time()
            fault, findings = "", Findings(())
            try:
                findings = element.compute()
            except (LtlplanError, ArithmeticError, AssertionError, LookupError, TypeError, ValueError) as error:
                fault = f"{type(error).__name__}: {error}"
            found[name] = findings, time.process_time() - begun, fault
    return found


@contextmanager
def _ending(progress: Progress) -> Generator[None]:
    """End this process soon after nobody waits for it any more, which reporting says by an exception: an element may take a minute."""
    over = threading.Event()

    def watch() -> None:
        while not over.wait(1.0):
            try:
                progress("", 0.0)
            except Exception:  # whatever says so
                os._exit(1)

    threading.Thread(target=watch, daemon=True).start()
    try:
        yield
    finally:
        over.set()
