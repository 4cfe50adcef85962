"""State of an installation: the core's libraries, those of each extra, engines that answer, and links that somebody answers on."""

from __future__ import annotations

import contextlib
import importlib.metadata
import os
import platform
import socket
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from packaging.requirements import Requirement

EXTRAS = {
    "crazyflie": "fly Crazyflies over Crazyradio, upload trajectories, read motion capture",
    "px4": "fly PX4 vehicles over MAVLink, export missions for them",
    "ros": "export ROS 2 bags, follow events on a ROS 2 topic",
    "parquet": "write and read flight logs as Parquet",
    "mcap": "write and read flight logs as MCAP, for Foxglove",
    "logs": "judge recordings: PX4's ULog, ROS 2 bags, MCAP",
    "service": "serve planning over HTTP with its page (`ltlplan serve`), and ask a service (`ltlplan.Client`)",
    "openid": "let people log in to a service by OpenID Connect",
    "postgres": "keep a service's jobs in PostgreSQL",
    "dask": "compute by the workers of a Dask cluster",
    "hypothesis": "draw random missions and flights in your own tests (`verify.testing`)",
}
"""What each extra adds for a user. Those that only developers need are left out."""
MAVLINK = 14540
"""UDP port on which PX4 talks to a companion computer."""
LISTEN = 1.5
"""s to listen for a heartbeat; PX4 sends one a second."""

_SMALL = "firefighting"

State = Literal["ok", "missing", "old"]


@dataclass(frozen=True, slots=True)
class Library:
    """A library that is asked for.

    Attributes:
        name: Of the distribution.
        version: What is installed; empty where it is not.
        asked: Versions that are asked for, such as `>=3.6.7,<4`.
    """

    name: str
    version: str
    asked: str

    @property
    def state(self) -> State:
        """Return whether it is installed, in a version that is asked for."""
        if not self.version:
            return "missing"
        return "ok" if Requirement(f"{self.name}{self.asked}").specifier.contains(self.version, prereleases=True) else "old"

    def __str__(self) -> str:
        if self.state == "ok":
            return f"{self.name} {self.version}"
        return f"{self.name} is missing" if self.state == "missing" else f"{self.name} {self.version} is not {self.asked}"


@dataclass(frozen=True, slots=True)
class Probe:
    """Answer of an engine, or on a link.

    Attributes:
        name: What was asked.
        answers: Whether it answered.
        sentence: What it said, or what did not.
    """

    name: str
    answers: bool
    sentence: str


def libraries(extra: str = "") -> tuple[Library, ...] | None:
    """Return the libraries that the core, or one extra, asks for on this machine; None where ltlplan itself is not installed.

    Args:
        extra: Its name; empty for the core.
    """
    try:
        asked = [Requirement(text) for text in importlib.metadata.requires("ltlplan") or ()]
    except importlib.metadata.PackageNotFoundError:
        return None
    core = {item.name for item in asked if item.marker is None or item.marker.evaluate({"extra": ""})}
    wanted = [
        item
        for item in asked
        if (item.marker is None or item.marker.evaluate({"extra": extra})) and (not extra or item.name not in core)
    ]
    return tuple(Library(item.name, _version(item.name), str(item.specifier)) for item in wanted)


def engines() -> tuple[Probe, ...]:
    """Return whether Spot translates, and whether a shipped mission is planned, refined and certified."""
    return (_tried("Spot", _translate), _tried("planning", _certify))


def links() -> tuple[Probe, ...]:
    """Return who answers now: a Crazyradio, a PX4 vehicle, a service on this machine."""
    return tuple(
        _tried(name, work)
        for name, work in (("Crazyradio", _radio), (f"MAVLink on UDP port {MAVLINK}", _heartbeat), ("service", _service))
    )


def machine() -> str:
    """Return what this machine is, for a person."""
    return f"Python {platform.python_version()}, {platform.system()} {platform.machine()}, {os.cpu_count()} processors"


def _version(name: str) -> str:
    try:
        return importlib.metadata.version(name)
    except importlib.metadata.PackageNotFoundError:
        return ""


class _Silent(Exception):
    """Raised where nobody answers; the message says who was asked."""


def _tried(name: str, work: Callable[[], str]) -> Probe:
    try:
        return Probe(name, True, work())
    except _Silent as silent:
        return Probe(name, False, str(silent))
    except Exception as error:  # whatever a driver or an engine raises is what is wrong with it
        return Probe(name, False, f"{type(error).__name__}: {error}")


def _translate() -> str:
    from ltlplan.logic import spot_engine

    spot_engine.translate('F "a"', "infinite")
    return f"version {spot_engine.engine().version()}"


def _certify() -> str:
    import ltlplan
    import refine
    import verify

    begun = time.perf_counter()
    plan = ltlplan.plan(ltlplan.load_mission(_SMALL))
    claims = verify.certify(plan, refine.refine(plan)).claims
    return f"{_SMALL} is planned, refined and certified, {len(claims)} claims, in {time.perf_counter() - begun:.1f} s"


def _radio() -> str:
    try:
        from cflib import crtp
    except ImportError:
        raise _Silent("not asked: the extra crazyflie is not installed") from None
    crtp.init_drivers()
    said = str(crtp.get_interfaces_status().get("radio", "no driver"))
    if "not found" in said or "no driver" in said:
        raise _Silent("none is plugged in, or it may not be opened")
    return said


def _heartbeat() -> str:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as port:
        port.settimeout(LISTEN)
        try:
            port.bind(("0.0.0.0", MAVLINK))
            _data, sender = port.recvfrom(512)
        except TimeoutError:
            raise _Silent(f"nobody sent anything within {LISTEN:g} s") from None
        except OSError as error:
            raise _Silent(f"cannot listen: {error.strerror}") from None
    return f"{sender[0]} sends"


def _service() -> str:
    from ltlplan.service.settings import LOOPBACK, PORT

    with contextlib.suppress(OSError), socket.create_connection((LOOPBACK, PORT), timeout=LISTEN):
        return f"something listens on http://{LOOPBACK}:{PORT}"
    raise _Silent(f"nobody listens on http://{LOOPBACK}:{PORT}")
