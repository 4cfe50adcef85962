"""Responses to rejected requests: problem details for programs, a page for people."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass

from ltlplan.service.problems import MEDIA_TYPE, problem_of
from ltlplan.service.security.plain_pages import refusal_page

HTML = "text/html; charset=utf-8"


@dataclass(frozen=True, slots=True)
class Refusal:
    """An answer that refuses.

    Attributes:
        status: HTTP status.
        headers: By lower-case name.
        content: The body.
    """

    status: int
    headers: dict[str, str]
    content: bytes


def refusal(error: BaseException, asked: Mapping[str, str], status: int | None = None) -> Refusal:
    """Return what tells an error to those who asked.

    Args:
        error: What was raised.
        asked: Headers of the request, by lower-case name; a browser that goes to a page is answered with one.
        status: HTTP status, instead of the error's own.
    """
    problem = problem_of(error)
    if status is not None:
        problem = problem.model_copy(update={"status": status})
    headers: dict[str, str] = {}
    seconds = getattr(error, "seconds", None)
    if seconds is not None:
        headers["retry-after"] = str(max(1, math.ceil(seconds)))
    if problem.status == 401:
        headers["www-authenticate"] = "Bearer"
    if reads_pages(asked):
        return Refusal(problem.status, {"content-type": HTML, **headers}, refusal_page(problem).encode("utf-8", "replace"))
    content = json.dumps(problem.model_dump(mode="json"), allow_nan=False).encode("utf-8", "backslashreplace")
    return Refusal(problem.status, {"content-type": MEDIA_TYPE, **headers}, content)


def reads_pages(asked: Mapping[str, str]) -> bool:
    """Return whether a request is a browser's that goes to a page, by its headers."""
    return "text/html" in asked.get("accept", "").lower()
