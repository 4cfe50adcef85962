"""Chromium spoken to over its DevTools protocol, through two pipes: no port, no driver, no further library.

One browser serves all tests of a module; each page is a tab of its own. Nothing here sleeps for a fixed time: a condition is waited for in the
page, and a generous limit ends the wait only where the page is broken.
"""

from __future__ import annotations

import base64
import fcntl
import json
import os
import queue
import shutil
import subprocess
import sys
import threading
from collections.abc import Mapping
from pathlib import Path
from typing import Any

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")

LIMIT = 240.0
"""s that an answer may take: many times what an idle machine needs."""

_OPTIONS = (
    "--headless", "--no-sandbox", "--disable-gpu", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
    "--disable-quic", "--no-first-run", "--disable-background-networking", "--disable-component-update", "--disable-sync",
    "--disable-dev-shm-usage", "--disable-background-timer-throttling", "--disable-renderer-backgrounding",
    "--disable-backgrounding-occluded-windows", "--host-resolver-rules=MAP * ~NOTFOUND", "--remote-debugging-pipe",
)  # fmt: skip


_LAUNCH = "import os, sys; os.dup2(int(sys.argv[1]), 3); os.dup2(int(sys.argv[2]), 4); os.execv(sys.argv[3], sys.argv[3:])"
"""Chromium reads commands from file descriptor 3 and answers on 4."""


class Browser:
    """A running Chromium without a network."""

    def __init__(self, profile: Path) -> None:
        assert CHROMIUM is not None
        reads, self._out = os.pipe()
        self._in, writes = os.pipe()
        theirs = [fcntl.fcntl(end, fcntl.F_DUPFD, 10) for end in (reads, writes)]  # clear of 3 and 4
        self._process = subprocess.Popen(
            [sys.executable, "-c", _LAUNCH, *map(str, theirs), CHROMIUM, *_OPTIONS, f"--user-data-dir={profile}"],
            pass_fds=theirs, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip
        for end in (reads, writes, *theirs):
            os.close(end)
        self._answers: dict[int, queue.Queue[dict[str, Any]]] = {}
        self._tabs: dict[str, Tab] = {}
        self._number = 0
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def open(
        self,
        page: Path,
        *,
        width: int = 1000,
        phone: bool = False,
        dark: bool = False,
        before: str = "",
        ready: str | None = None,
    ) -> Tab:
        """Open a page in a tab of its own and wait until it is ready.

        Args:
            page: A file.
            width: Of the window, in CSS pixels.
            phone: Whether it is a phone, whose scroll bars take no room.
            dark: Whether the reader prefers dark colours.
            before: A script that runs before the page's own.
            ready: A condition in JavaScript; by default that the page says of itself that all is drawn.
        """
        target = self.call("Target.createTarget", {"url": "about:blank"})["targetId"]
        session = self.call("Target.attachToTarget", {"targetId": target, "flatten": True})["sessionId"]
        tab = self._tabs[session] = Tab(self, target, session)
        for domain in ("Page", "Runtime", "Log", "Network"):
            tab.call(f"{domain}.enable")
        metrics = {"width": width, "height": 700, "deviceScaleFactor": 1, "mobile": phone}
        tab.call("Emulation.setDeviceMetricsOverride", metrics)
        colours = [{"name": "prefers-color-scheme", "value": "dark" if dark else "light"}]
        tab.call("Emulation.setEmulatedMedia", {"features": colours})
        if before:
            tab.call("Page.addScriptToEvaluateOnNewDocument", {"source": before})
        tab.call("Page.navigate", {"url": page.as_uri()})
        tab.wait("document.readyState === 'complete' && location.href !== 'about:blank'")
        tab.wait(ready or "document.body.dataset.ready === 'yes'")
        return tab

    def call(self, method: str, parameters: Mapping[str, Any] | None = None, session: str | None = None) -> dict[str, Any]:
        """Send one command and return its result; fail where the browser refuses it or says nothing."""
        self._number += 1
        number = self._number
        answers = self._answers[number] = queue.Queue()
        message: dict[str, Any] = {"id": number, "method": method, "params": dict(parameters or {})}
        if session is not None:
            message["sessionId"] = session
        data = json.dumps(message).encode() + b"\0"
        while data:
            data = data[os.write(self._out, data) :]
        try:
            answer = answers.get(timeout=LIMIT)
        except queue.Empty:
            raise AssertionError(f"{method}: no answer within {LIMIT:g} s") from None
        finally:
            del self._answers[number]
        assert "error" not in answer, f"{method}: {answer['error']}"
        return answer["result"]

    def close(self) -> None:
        """End the browser."""
        os.close(self._out)  # it ends when nobody can speak to it any more
        try:
            self._process.wait(20)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self._reader.join(20)
        os.close(self._in)

    def _read(self) -> None:
        held = b""
        while data := os.read(self._in, 1 << 20):
            *messages, held = (held + data).split(b"\0")
            for message in messages:
                told = json.loads(message)
                if "id" in told and told["id"] in self._answers:
                    self._answers[told["id"]].put(told)
                elif told.get("sessionId") in self._tabs:
                    self._tabs[told["sessionId"]].events.append(told)


class Tab:
    """A page in the browser, with all that it told: `events`."""

    def __init__(self, browser: Browser, target: str, session: str) -> None:
        self._browser, self._target, self._session = browser, target, session
        self.events: list[dict[str, Any]] = []

    def to_front(self) -> Tab:
        """Bring the tab to the front: one behind others draws nothing."""
        self.call("Page.bringToFront")
        return self

    def call(self, method: str, parameters: Mapping[str, Any] | None = None) -> dict[str, Any]:
        """Send one command to this page."""
        return self._browser.call(method, parameters, self._session)

    def run(self, expression: str) -> Any:
        """Return the value of an expression in JavaScript; a promise is waited for."""
        asked = {"expression": expression, "awaitPromise": True, "returnByValue": True}
        answer = self.call("Runtime.evaluate", asked)
        assert "exceptionDetails" not in answer, f"{expression}: {answer['exceptionDetails']}"
        return answer["result"].get("value")

    def move_clock(self, time: str) -> None:
        """Move the player's slider, where the page has one, to a time in JavaScript."""
        self.run(
            f"""(() => {{
              const clock = document.getElementById("clock");
              if (!clock) return;
              clock.value = {time};
              clock.dispatchEvent(new Event("input"));
            }})()"""
        )

    def wait(self, condition: str) -> None:
        """Wait until a condition in JavaScript holds."""
        limit = round(1000 * (LIMIT - 20))
        self.run(
            f"""new Promise((done, fail) => {{
              const end = Date.now() + {limit};
              const look = () => {{
                if ({condition}) done(true);
                else if (Date.now() > end) fail(new Error("never so: " + {json.dumps(condition)}));
                else setTimeout(look, 20);
              }};
              look();
            }})"""
        )

    def complaints(self) -> list[str]:
        """Return what the page put on the console as an error or a warning, and exceptions that nothing caught."""
        found: list[str] = []
        for event in self.events:
            told = event["params"]
            if event["method"] == "Runtime.exceptionThrown":
                found.append(told["exceptionDetails"].get("exception", {}).get("description", told["exceptionDetails"]["text"]))
            elif event["method"] == "Runtime.consoleAPICalled" and told["type"] in ("error", "assert"):
                found.append(" ".join(str(part.get("value", part.get("description"))) for part in told["args"]))
            elif event["method"] == "Log.entryAdded" and told["entry"]["level"] == "error":
                found.append(told["entry"]["text"])
        return found

    def fetched(self) -> list[str]:
        """Return the addresses that the page asked for, its own and data inside it left out."""
        asked = [event["params"]["request"]["url"] for event in self.events if event["method"] == "Network.requestWillBeSent"]
        return [url for url in asked[1:] if not url.startswith(("data:", "blob:"))]

    def picture(self, *, whole: bool = False) -> bytes:
        """Return the page as PNG: what the window shows, or all of it."""
        asked: dict[str, Any] = {"format": "png", "captureBeyondViewport": whole}
        if whole:
            size = self.call("Page.getLayoutMetrics")["cssContentSize"]
            asked["clip"] = {"x": 0, "y": 0, "width": size["width"], "height": size["height"], "scale": 1}
        return base64.b64decode(self.call("Page.captureScreenshot", asked)["data"])

    def close(self) -> None:
        """Close the tab."""
        self._browser.call("Target.closeTarget", {"targetId": self._target})
