"""What a browser fetches of the service: text compressed, and what does not change once only."""

from __future__ import annotations

from typing import Any

from tests.browser.visitor import OF_THE_PAGE, Visitor

pytestmark = OF_THE_PAGE

MOST_REQUESTS, MOST_BYTES, MOST_AGAIN = 40, 900_000, 40_000
"""Of a page that is loaded for the first time, and bytes of one that is loaded again: a quarter above what there is."""
TEXT = ("text/", "application/json", "application/javascript")


def _load(visitor: Visitor) -> list[dict[str, Any]]:
    """Load the page, and return what was fetched: address, headers, bytes on the line, whether from the cache."""
    session = visitor.context.new_cdp_session(visitor.page)
    found: dict[str, dict[str, Any]] = {}

    def answered(event: dict[str, Any]) -> None:
        answer = event["response"]
        headers = {name.lower(): value for name, value in answer["headers"].items()}
        cached = answer.get("fromDiskCache") or event["requestId"] in held
        found[event["requestId"]] = {"url": answer["url"], "headers": headers, "cached": cached, "bytes": 0}

    held: set[str] = set()
    session.on("Network.requestServedFromCache", lambda event: held.add(event["requestId"]))
    session.on("Network.responseReceived", answered)
    session.on(
        "Network.loadingFinished", lambda event: found.get(event["requestId"], {}).update(bytes=event["encodedDataLength"])
    )
    session.send("Network.enable")
    visitor.open("/plan")
    visitor.page.wait_for_selector("[role=tab]")
    visitor.page.wait_for_load_state("networkidle")
    session.detach()
    return [each for each in found.values() if each["url"].startswith("http")]


def test_what_does_not_change_is_fetched_once_and_text_is_compressed(address: str, chromium: Any) -> None:
    visitor = Visitor(chromium, address)
    first = _load(visitor)
    assert len(first) <= MOST_REQUESTS
    assert 100_000 < sum(each["bytes"] for each in first) <= MOST_BYTES
    for each in first:
        headers = each["headers"]
        if headers["content-type"].startswith(TEXT) and each["bytes"] > 2000:
            assert headers.get("content-encoding") in ("gzip", "br"), each["url"]
        changes = each["url"].endswith("/plan") or "/api/" in each["url"]
        assert ("no-store" in headers["cache-control"]) == changes, each["url"]
        assert changes or ("immutable" in headers["cache-control"] and "etag" in headers), each["url"]
    again = _load(visitor)
    fetched = {each["url"].removeprefix(address) for each in again if not each["cached"]}
    assert fetched <= {"/plan", "/api/live", "/favicon.ico"}
    assert sum(each["bytes"] for each in again) <= MOST_AGAIN
    visitor.end()
