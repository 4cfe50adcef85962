"""Begin and end of the command line: it sees to interrupts and closed outputs before anything that takes time is loaded."""

from __future__ import annotations

import gc
import io
import os
import signal
import sys
from weakref import ref

TYPE_CHECKING = False  # as in `ltlplan`: until the interrupt is seen to, nothing is loaded that need not be
if TYPE_CHECKING:
    from types import FrameType
    from typing import NoReturn

    from typing_extensions import Buffer

BROKEN_PIPE = 128 + 13
"""Exit code where the reader of our output has gone, as in `ltlplan plan firefighting | head -1`: a shell's for SIGPIPE."""
INTERRUPTED = 128 + 2
CLOSED = 2
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
_GARBAGE = (50_000, 10, 10)
"""Objects made until cycles among them are looked for, and rounds until older ones are: hardly any are garbage while modules load."""
_AGAIN = 0.1
"""s until an interrupt that got lost is raised again."""


def main() -> NoReturn:
    """Run the command line; end with the exit code of the error, if any, and without a traceback for mistakes.

    Raises:
        SystemExit: Always, with the exit code.
    """
    interrupts = _Interrupts()
    interrupts.attend()
    compute_in_one_thread()
    gc.set_threshold(*_GARBAGE)
    code: int | str | None = INTERRUPTED
    try:
        end_cleanly_on_sigterm()
        code = _outcome(as_json="--json" in sys.argv, interrupts=interrupts) if _has_outputs() else CLOSED
        interrupts.over = True
    except BaseException:
        interrupts.over = True
        if not interrupts.heard:
            raise
    if code == INTERRUPTED and interrupts.heard:
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        sys.stderr.write("interrupted; no file was left half-written.\n")
        sys.stderr.flush()
        gc.collect()  # semaphores that were shared with processes go with their last user, else their tracker complains
        os._exit(INTERRUPTED)  # the interpreter's own end may turn it into a death by signal, if a library was being loaded
    gc.freeze()  # the interpreter's own end would look through all that was loaded, twice
    sys.exit(code)


def compute_in_one_thread() -> None:
    """Have numpy's linear algebra use one thread, unless the environment says otherwise; to be called before numpy is loaded.

    The matrices here are small: more threads only wait for one another, busily, on cores that others could use. Who asks for a number
    of threads by OMP_NUM_THREADS alone gets it of every library.
    """
    asked = os.environ.get(THREADS[0], "1")
    for name in THREADS:
        os.environ.setdefault(name, asked)


def _outcome(*, as_json: bool, interrupts: _Interrupts) -> int | str | None:
    """Run the command and return its exit code; errors have been told by then."""
    try:
        from ltlplan.cli import app

        code = app(standalone_mode=False)
        sys.stdout.flush()
        return code
    except SystemExit as ended:  # typer's own word for a reader that has gone is 1, which is ours for a bug
        if ended.code == 1 and not any(name.endswith("_COMPLETE") for name in os.environ):
            return _let_go()
        return _flushed(ended.code)
    except BrokenPipeError:
        return _let_go()
    except Exception as error:  # the outermost door: every error becomes a message and an exit code
        if interrupts.heard:  # whatever the interrupt became on its way here, such as an ImportError of a library
            return INTERRUPTED
        from ltlplan.commands.support.terminal import report

        try:
            return _flushed(report(error, as_json=as_json))
        except BrokenPipeError:
            return _let_go()


def _flushed(code: int | str | None) -> int | str | None:
    """Write out what was printed, so that a full disk or a reader that has gone shows while it can be told."""
    try:
        sys.stdout.flush()
    except BrokenPipeError:
        return _let_go()
    except OSError as error:
        from ltlplan.commands.support.terminal import report

        return report(error, as_json=False)
    return code


def _let_go() -> int:
    """Say nothing more to a reader that has gone."""
    from ltlplan.commands.support.terminal import close_output

    close_output()
    return BROKEN_PIPE


def _has_outputs() -> bool:
    """Return whether standard output is open; where another standard stream is closed, let it be the null device.

    A closed one's number would else be given to the next file that is opened, and what libraries print would go into that.
    """
    closed = sys.stdout is None
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # takes the lowest number that is free, which is this one
    encoding = "utf-8" if sys.stderr is None else sys.stderr.encoding
    patient = io.BufferedWriter(_Patient(2, "wb", closefd=False))
    sys.stderr = io.TextIOWrapper(patient, encoding=encoding, errors="backslashreplace", line_buffering=True)
    if closed:
        sys.stderr.write("bad input: Standard output is closed; send it to a file, a program or /dev/null.\n")
    return not closed


class _Patient(io.FileIO):
    """Standard error that may be full, or whose reader may have gone: no reason to give up work, which has an output and a code."""

    def write(self, data: Buffer, /) -> int:
        try:
            return super().write(data)
        except OSError:
            return memoryview(data).nbytes


class _Interrupt(KeyboardInterrupt):
    """Ctrl-C, as an object whose end can be noticed."""


class _Interrupts:
    """Ctrl-C raises KeyboardInterrupt here, and again wherever a library lets that go unheard, until the end is reached.

    Some code drops every exception: weak references' callbacks, which run while modules are loaded, `try: import ...` of parts that
    may be absent, callbacks out of C. The work would go on as if nobody had asked for its end.

    Attributes:
        heard: Whether there was one.
        over: Whether the end is reached, so that none is raised any more.
    """

    def __init__(self) -> None:
        self.heard = self.over = False
        self._raised: ref[_Interrupt] | None = None

    def attend(self) -> None:
        """Begin; where Ctrl-C is ignored it stays ignored."""
        if signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
            return
        signal.signal(signal.SIGINT, self._hear)
        if hasattr(signal, "setitimer"):
            signal.signal(signal.SIGALRM, self._hear)
        shown = sys.unraisablehook
        sys.unraisablehook = lambda lost: None if isinstance(lost.exc_value, _Interrupt) else shown(lost)

    def _hear(self, _number: int, _frame: FrameType | None) -> None:
        if self.over:
            return
        self.heard = True
        interrupt = _Interrupt()
        self._raised = ref(interrupt, self._lose)
        raise interrupt

    def _lose(self, _gone: ref[_Interrupt]) -> None:
        if not self.over and hasattr(signal, "setitimer"):
            signal.setitimer(signal.ITIMER_REAL, _AGAIN)


def end_cleanly_on_sigterm() -> None:
    """Let SIGTERM unwind the stack, as Ctrl-C does, so that unfinished folders go; only in this process, not in its workers."""
    mine = os.getpid()

    def end(number: int, _frame: object) -> None:
        if os.getpid() != mine:
            os._exit(128 + number)
        raise SystemExit(128 + number)

    signal.signal(signal.SIGTERM, end)
