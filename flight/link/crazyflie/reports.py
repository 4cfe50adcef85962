"""Reports of a Crazyflie: its estimated position, its supervisor, its battery, and its estimator's variances."""

from __future__ import annotations

import functools
import math
from collections import deque
from collections.abc import Callable
from typing import Any

from flight.exports.scripts.flying import supervisor
from flight.exports.scripts.flying.supervisor import State
from flight.link.link import Pose
from flight.monitoring.thresholds import SETTLED

_DRIFT = 2e-4
"""Share by which a vehicle's clock may run slower than ours."""
_HALF = 1 << 23
"""Half of the milliseconds that a vehicle counts before it begins anew."""
_POSE = ("stateEstimate.x", "stateEstimate.y", "stateEstimate.z", "stateEstimate.yaw")
_VARIANCES = ("kalman.varX", "kalman.varY", "kalman.varZ")
_TARGET = ("ctrltarget.x", "ctrltarget.z")
_HEALTH = ("supervisor.info", "pm.batteryLevel", "pm.state", *_VARIANCES)
_WHOLE = 0.02
"""Part of a millimetre by which a streamed set-point's place, of whole ones, is off in float32."""


class Reports:
    """Reports of one vehicle, as they come.

    Attributes:
        estimate: Where it takes itself to be.
        tells_target: Whether it says what place it follows.
        own_target_at: When it last said that it follows a place of its own, which has parts of a millimetre, s.
    """

    def __init__(self, now: Callable[[], float]) -> None:
        """Begin with nothing.

        Args:
            now: The link's clock, s.
        """
        self._now = now
        self.estimate: Pose | None = None
        self.tells_target = False
        self.own_target_at = -math.inf
        self._told: dict[str, float] = {}
        self._tells = False
        self._told_at, self._stamp, self._offset, self._offset_at = -math.inf, 0, math.inf, 0.0
        self._variances: deque[tuple[float, ...]] = deque(maxlen=10)

    def begin(self, cf: Any, send: Callable[[Callable[[], object]], None]) -> list[str]:  # cflib has no types
        """Have a vehicle report; return what its firmware does not have of what is needed.

        Args:
            cf: cflib's Crazyflie, connected.
            send: Has something sent after what waits already.
        """
        from cflib.crazyflie.log import LogConfig

        toc = cf.log.toc.toc
        has = [name for name in (*_POSE, *_TARGET, *_HEALTH) if name.split(".")[1] in toc.get(name.split(".")[0], {})]
        if missing := [name for name in _POSE if name not in has]:
            return missing
        for block, period, names in (("pose", 20, (*_POSE, *_TARGET)), ("health", 50, _HEALTH)):
            if not (kept := [name for name in names if name in has]):
                continue
            self._tells |= names is _HEALTH
            self.tells_target |= all(name in kept for name in _TARGET)
            config = LogConfig(name=block, period_in_ms=period)
            for name in kept:
                config.add_variable(name)
            config.data_received_cb.add_callback(self._tell if names is _HEALTH else self._place)
            send(functools.partial(_start, cf, config))
        return []

    def _place(self, stamp: int, values: dict[str, float], _config: object) -> None:
        """Take in a pose, at the instant when it was measured: the least delay of all packets is the one that counts."""
        now = self._now()
        since = self._stamp + ((stamp - self._stamp + _HALF) % (2 * _HALF) - _HALF)
        if self.estimate is not None and since <= self._stamp:
            return  # it was overtaken on its way
        self._stamp = since
        self._offset = min(self._offset + _DRIFT * (now - self._offset_at), now - since / 1000.0)
        self._offset_at = now
        x, y, z, yaw = (values[name] for name in _POSE)
        self.estimate = Pose(since / 1000.0 + self._offset, (x, y, z), math.radians(yaw))
        followed = [values[name] for name in _TARGET if math.isfinite(values.get(name, math.nan))]
        if any(abs(math.remainder(1000.0 * value, 1.0)) > _WHOLE for value in followed):
            self.own_target_at = now

    def _tell(self, _stamp: int, values: dict[str, float], _config: object) -> None:
        self._told, self._told_at = dict(values), self._now()
        if all(name in values for name in _VARIANCES):
            self._variances.append(tuple(values[name] for name in _VARIANCES))

    @property
    def state(self) -> State | None:
        """Last state of its supervisor; None where it reports nothing."""
        info = self._told.get("supervisor.info")
        return None if info is None else State(int(info))

    @property
    def state_at(self) -> float:
        """Time of that report, s."""
        return self._told_at

    @property
    def watched(self) -> bool:
        """True if its pose is known, and its health for half a second, where it says something of it."""
        health = not self._tells or (bool(self._told) and len(self._variances) in (0, self._variances.maxlen))
        return health and self.estimate is not None

    @property
    def settled(self) -> bool | None:
        """True if the variances of its estimated position stay as they are; None where it does not say."""
        return supervisor.is_settled(self._variances, {"settled": SETTLED})

    @property
    def battery(self) -> float | None:
        """Share of its charge that is left; None where it does not say."""
        return supervisor.charge_of(self._told.get("pm.state", 0.0), self._told.get("pm.batteryLevel"))


def _start(cf: Any, config: Any) -> None:
    cf.log.add_config(config)
    config.start()
