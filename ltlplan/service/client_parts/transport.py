"""Transport to a service: one connection, errors of the library's own classes, and validated answers."""

from __future__ import annotations

import json
import re
import zipfile
from collections.abc import Iterator
from io import BytesIO
from typing import TYPE_CHECKING, Any, TypeVar
from urllib.parse import quote

from pydantic import BaseModel, ValidationError

from ltlplan.service.models import Event, Job, Problem
from ltlplan.service.problems import MEDIA_TYPE, Unreachable, error_of
from verify.data import BadInput, InternalError, MissingEngine

if TYPE_CHECKING:
    import httpx

Model = TypeVar("Model", bound=BaseModel)

_MOST_UNPACKED = 500_000_000


class Wire:
    """A connection to a service.

    Attributes:
        url: Where it is.
        patience: s that an answer is waited for.
    """

    def __init__(self, url: str, token: str | None, patience: float) -> None:
        try:
            import httpx
        except ModuleNotFoundError:
            raise MissingEngine("`ltlplan.Client` needs httpx: pip install 'ltlplan[service]'.") from None
        if not isinstance(url, str) or not re.match(r"https?://[^/]", url):  # pyright: ignore[reportUnnecessaryIsInstance]  # callers may not check
            raise BadInput(f"A service's address looks like http://127.0.0.1:8000, not {str(url)[:100]!r}.")
        self.url, self.patience = url.rstrip("/"), patience
        headers = {} if token is None else {"authorization": f"Bearer {token}"}
        secure = self.url.startswith(
            "https:"
        )  # else no certificates of authorities are loaded, which takes longer than a request
        self._http = httpx.Client(base_url=self.url, headers=headers, timeout=patience, verify=secure)

    def close(self) -> None:
        """Let go of the connection."""
        self._http.close()

    def ask(self, method: str, path: str, *, also: tuple[int, ...] = (), **given: Any) -> httpx.Response:  # as httpx takes them
        """Return what the service answers.

        Args:
            method: Of HTTP.
            path: What is asked for.
            also: Statuses that are answers too, besides those of success.
            given: Body, headers and so on.

        Raises:
            LtlplanError: What the service refused with.
            Unreachable: It does not answer, or what answers is no service of ours.
        """
        import httpx

        try:
            answer = self._http.request(method, path, **given)
        except httpx.TimeoutException:
            raise Unreachable(f"{self.url} did not answer in time.") from None
        except httpx.HTTPError as error:
            raise Unreachable(f"{self.url} cannot be reached: {error}. `ltlplan serve` starts a service.") from None
        if answer.status_code not in also:
            require_success(answer.status_code, answer.headers.get("content-type", ""), answer.content, self.url)
        return answer

    def events(self, job: str, after: int) -> Iterator[Event]:
        """Yield a job's events after one, from one stream.

        Args:
            job: The job's id.
            after: Only events with a greater id.

        Raises:
            LtlplanError: What the service refused.
            ConnectionError: The stream broke.
        """
        import httpx

        headers = {"last-event-id": str(after)}
        waiting = httpx.Timeout(self.patience)
        try:
            with self._http.stream("GET", f"/api/jobs/{segment(job)}/events", headers=headers, timeout=waiting) as answer:
                if answer.status_code == 204:
                    return
                if answer.status_code != 200:
                    answer.read()
                require_success(
                    answer.status_code,
                    answer.headers.get("content-type", ""),
                    b"" if answer.is_success else answer.content,
                    self.url,
                )
                for line in answer.iter_lines():
                    if line.startswith("data:"):
                        yield checked(Event, json.loads(line.removeprefix("data:")))
        except httpx.HTTPError as error:
            raise ConnectionError(str(error)) from None


def require_success(status: int, media_type: str, content: bytes, url: str) -> None:
    """Raise what an answer refuses with.

    Args:
        status: HTTP status.
        media_type: Kind of content.
        content: The answer's.
        url: Who answered.

    Raises:
        LtlplanError: The library's own error, or that this is no answer of a service of ours.
    """
    if 200 <= status < 300:
        return
    if media_type.startswith(MEDIA_TYPE):
        try:
            raise error_of(Problem.model_validate_json(content))
        except ValidationError:
            pass
    raise Unreachable(f"{url} answered with status {status}, which is none of a service of ltlplan.")


def checked(model: type[Model], data: object) -> Model:
    """Return an answer as a value.

    Raises:
        Unreachable: It is none.
    """
    try:
        return model.model_validate(data)
    except ValidationError as error:
        raise Unreachable(
            f"The service's answer is not understood: {error.errors()[0]['msg']}; versions differ too much."
        ) from None


def job_of(content: bytes) -> Job:
    """Return the job of an answer."""
    return checked(Job, json.loads(content))


def segment(text: str) -> str:
    """Return a part of a path, so that it can be no other path."""
    return quote(text, safe="")


def unpacked(packed: bytes) -> dict[str, bytes]:
    """Return an archive's files.

    Raises:
        BadInput: A name in it would lead out of a folder, or it is larger than any run's.
        InternalError: It cannot be read.
    """
    try:
        with zipfile.ZipFile(BytesIO(packed)) as archive:
            entries = archive.infolist()
            if sum(entry.file_size for entry in entries) > _MOST_UNPACKED:
                raise BadInput("The service's archive is larger than any run's.")
            for entry in entries:
                parts = entry.filename.split("/")
                if "\\" in entry.filename or any(part in ("", ".", "..") for part in parts) or ":" in parts[0]:
                    raise BadInput(f"The service's archive holds the name {entry.filename[:80]!r}, which is rejected.")
            return {entry.filename: archive.read(entry) for entry in entries}
    except zipfile.BadZipFile:
        raise InternalError("The service's archive cannot be read.") from None
