"""The service in a process of its own, and a browser's window that looks at its page."""

from __future__ import annotations

import os
import queue
import re
import subprocess
import sys
import threading
from collections.abc import Generator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from tests.browser.devtools import CHROMIUM

pytest.importorskip("nicegui", reason="needs the service's extra")
pytest.importorskip("playwright.sync_api", reason="needs Playwright to drive a browser")

OF_THE_PAGE = [
    pytest.mark.browser,
    pytest.mark.slow,
    pytest.mark.skipif(CHROMIUM is None, reason="needs Chromium to look at the page"),
]
"""Marks of tests that look at the service's page."""
LIMIT = 240_000
"""ms that anything may take: many times what an idle machine needs."""
OPTIONS = [
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1",
]


@contextmanager
def served(data: Path, port: int = 0, words: Sequence[str] = ()) -> Generator[str]:
    """Serve a data folder as a user does, on a free port or a certain one, and yield where that is."""
    command = [sys.executable, "-m", "ltlplan", "serve", "--port", str(port), "--workers", "1", "--data", str(data), *words]
    own = {
        name: value for name, value in os.environ.items() if name != "PYTEST_CURRENT_TEST"
    }  # NiceGUI compresses nothing in tests
    started = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, env={**own, "OMP_NUM_THREADS": "1"}
    )
    lines: queue.Queue[str] = queue.Queue()
    reader = threading.Thread(target=lambda: [lines.put(line) for line in started.stdout or ()], daemon=True)
    reader.start()
    said = ""
    try:
        while not (found := re.search(r"http://127\.0\.0\.1:\d+", said)):
            assert started.poll() is None, said
            said += lines.get(timeout=LIMIT / 1000)
        yield found.group()
    finally:
        started.terminate()
        try:
            started.wait(30)
        except subprocess.TimeoutExpired:
            started.kill()
            started.wait()
        reader.join(30)
        assert started.stdout is not None
        started.stdout.close()


class Visitor:
    """A browser's window that notes whom it asks and what goes wrong in it."""

    def __init__(
        self, browser: Any, address: str, *, width: int = 1280, height: int = 800, dark: bool = False, context: Any = None
    ) -> None:
        self.address = address
        self.context = context or browser.new_context(
            viewport={"width": width, "height": height}, color_scheme="dark" if dark else "light", accept_downloads=True
        )
        self.context.set_default_timeout(LIMIT)
        self.page = self.context.new_page()
        self.elsewhere: list[str] = []
        self.complaints: list[str] = []
        self.page.on("request", self._asked)
        self.page.on("pageerror", lambda error: self.complaints.append(str(error)))
        self.page.on("console", lambda told: self.complaints.append(told.text) if told.type == "error" else None)

    def _asked(self, request: Any) -> None:
        if not request.url.startswith((self.address, "data:", "blob:")):
            self.elsewhere.append(request.url)

    def open(self, path: str) -> None:
        """Open a page of the service."""
        self.page.goto(self.address + path)

    def wait(self, condition: str) -> None:
        """Wait until a condition in JavaScript holds."""
        self.page.wait_for_function(f"() => {condition}", timeout=LIMIT)

    def said(self, place: str) -> str:
        """Return the text of a place."""
        return self.page.locator(place).first.inner_text()

    def tab(self, name: str) -> None:
        """Open a tab."""
        self.page.get_by_role("tab", name=name, exact=True).click()

    def at(self) -> str:
        """Return the tab that is seen."""
        return self.said("[role=tab][aria-selected=true]")

    def written(self) -> str:
        """Return the mission that is being written."""
        return self.page.evaluate("document.querySelector('.editor:not(.line)').editorView.state.doc.toString()")

    def write(self, text: str) -> None:
        """Write another mission, as by hand."""
        self.page.locator(".editor:not(.line) .cm-content").click()
        self.page.keyboard.press("Control+a")
        self.page.keyboard.insert_text(text)

    def checked(self) -> None:
        """Wait until the mission was checked and has no faults."""
        self.wait("document.querySelector('.state')?.textContent.includes('No faults')")

    def write_named(self, text: str, name: str) -> None:
        """Write another mission, as by hand, and wait until it was checked under its name."""
        self.write(text)
        self.wait(f"document.querySelector('.state').textContent.includes({name!r})")

    def save(self) -> None:
        """Save the mission that is written."""
        self.page.get_by_role("button", name="Save", exact=True).click()

    def write_formula(self, text: str) -> None:
        """Write a formula where formulas are written."""
        self.page.locator(".editor.line .cm-content").click()
        self.page.keyboard.press("Control+a")
        self.page.keyboard.insert_text(text)

    def end(self) -> None:
        """Close the window; it asked nobody else, and nothing went wrong in it."""
        self.context.close()
        assert self.elsewhere == []
        assert self.complaints == [], self.complaints
