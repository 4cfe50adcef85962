"""Log of the service: one JSON object a line on standard error; on a terminal, a short line for a person.

Noted are method, path, status, time taken and who asked (a token's name or an address): never a token, a cookie, a query, a header
or what was sent.
"""

from __future__ import annotations

import json
import logging
import sys
import time
import traceback
from typing import Any, TextIO

LOGGER = logging.getLogger("ltlplan.service")
_QUIET = 60.0
_NOISE = (
    "uvicorn.access",
    "asyncio",
    "websockets",
    "multipart",
    "python_multipart",
    "engineio.server",
    "socketio.server",
    "httpx",
    "watchfiles",
)


class _Repeats(logging.Filter):
    """Notes an error that is raised at the same place again at most once in `_QUIET` s, with how often it was meanwhile.

    Whoever sends what cannot be read, as often as a line takes it, would fill the disk with tracebacks.
    """

    def __init__(self) -> None:
        super().__init__()
        self._noted: dict[tuple[str, ...], tuple[float, int]] = {}

    def filter(self, record: logging.LogRecord) -> bool:
        if not record.exc_info or record.exc_info[0] is None:
            return True
        kind, _, trace = record.exc_info
        place = [f"{frame.f_code.co_filename}:{line}" for frame, line in traceback.walk_tb(trace)][-1:]
        key = (record.name, kind.__name__, *place)
        at, left_out = self._noted.get(key, (-_QUIET, 0))
        now = time.monotonic()
        if now - at < _QUIET:
            self._noted[key] = at, left_out + 1
            return False
        self._noted[key] = now, 0
        if left_out:
            record.said = {**getattr(record, "said", {}), "left_out": left_out}
        return True


class _Json(logging.Formatter):
    def format(self, record: logging.LogRecord) -> str:
        data = {"time": _utc(record.created), "level": record.levelname.lower(), "from": record.name, **_said(record)}
        if record.exc_info and record.exc_info[0] is not None:
            data["traceback"] = "".join(traceback.format_exception(*record.exc_info))
        return json.dumps(data, default=str)


class _Plain(logging.Formatter):
    def format(self, record: logging.LogRecord) -> str:
        said = _said(record)
        text = said.pop("event")
        if text == "request":
            text = "{method} {path} {status} {milliseconds:.0f} ms".format(**said)
        if record.levelno >= logging.WARNING:
            text = f"{record.levelname.lower()}: {text}"
        if record.exc_info and record.exc_info[0] is not None:
            text += "\n" + "".join(traceback.format_exception(*record.exc_info))
        return f"{time.strftime('%H:%M:%S', time.localtime(record.created))} {text}"


def _said(record: logging.LogRecord) -> dict[str, Any]:  # of any type: what was noted
    return {"event": record.getMessage(), **getattr(record, "said", {})}


def _utc(seconds: float) -> str:
    return time.strftime("%Y-%m-%dT%H:%M:%S", time.gmtime(seconds)) + f".{int(seconds % 1 * 1000):03d}Z"


def note(event: str, *, level: int = logging.INFO, **said: object) -> None:
    """Note that something happened.

    Args:
        event: What.
        level: How much it matters, as `logging` counts.
        said: More, by name; nothing secret.
    """
    LOGGER.log(level, "%s", event, extra={"said": said})


def note_bug(error: BaseException, **said: object) -> None:
    """Note an error that is a bug of ours, with its traceback.

    Args:
        error: What was raised.
        said: More, by name; nothing secret.
    """
    LOGGER.error("bug", exc_info=error, extra={"said": said})


def begin_log(stream: TextIO | None = None) -> None:
    """Begin to note: for the process of `ltlplan serve`, which has its log to itself.

    Args:
        stream: Where to; standard error by default.
    """
    stream = stream or sys.stderr
    handler = logging.StreamHandler(stream)
    handler.addFilter(_Repeats())
    handler.setFormatter(_Plain() if stream is not None and stream.isatty() else _Json())
    root = logging.getLogger()
    root.handlers[:] = [handler]
    root.setLevel(logging.WARNING)
    LOGGER.setLevel(logging.INFO)
    for name in _NOISE:
        logger = logging.getLogger(name)
        logger.handlers[:] = []  # some bring one of their own
        logger.setLevel(logging.ERROR)
    for name in ("uvicorn", "uvicorn.error", "dbos"):
        logger = logging.getLogger(name)
        logger.handlers[:] = []
        logger.propagate = True
        logger.setLevel(logging.WARNING)
