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
_NOISE = (
    "uvicorn.access",
    "asyncio",
    "websockets",
    "multipart",
    "python_multipart",
    "engineio",
    "socketio",
    "httpx",
    "watchfiles",
)


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
    handler.setFormatter(_Plain() if stream is not None and stream.isatty() else _Json())
    root = logging.getLogger()
    root.handlers[:] = [handler]
    root.setLevel(logging.WARNING)
    LOGGER.setLevel(logging.INFO)
    for name in _NOISE:
        logging.getLogger(name).setLevel(logging.ERROR)
    for name in ("uvicorn", "uvicorn.error", "dbos"):
        logger = logging.getLogger(name)
        logger.handlers[:] = []
        logger.propagate = True
        logger.setLevel(logging.WARNING)
