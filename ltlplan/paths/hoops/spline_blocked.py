"""The error of a spline that has no room: what it comes too near to, where, and how wide it is there."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ltlplan.free_space.bottlenecks import Gap, narrowest
from ltlplan.free_space.free_space import FreeSpace
from ltlplan.paths.hoops.clearance import Conflict
from ltlplan.paths.hoops.stops import Stop
from ltlplan.systems.unreachable import joined_names
from verify.data import Infeasible, Mission

_POINT = 1e-6
"""m; a way so long is a point."""


class SplineBlocked(Infeasible):
    """The spline through the control points still comes too near; carries the first place where it does.

    Attributes:
        conflict: What, on which piece and where.
    """

    def __init__(self, conflict: Conflict, stops: Sequence[Stop], gap: Gap | None = None) -> None:
        """Say what is in the way.

        Args:
            conflict: What, on which piece and where.
            stops: The control points.
            gap: How wide it is between obstacles there.
        """
        self.conflict, self.stops = conflict, tuple(stops)
        what = {
            "workspace": "leaves the workspace, margin included,",
            "again": f"comes twice to '{conflict.name}' in one visit",
            "plane": f"turns back within '{conflict.name}'",
            "ring": f"comes too near the ring of '{conflict.name}'",
            "region": f"touches '{conflict.name}', which it may not enter there,",
            "obstacle": f"comes too near the obstacle '{conflict.name}'",
        }[conflict.obstacle]
        after, before = stops[conflict.piece], stops[conflict.piece + 1]
        mend = "Move the hoop, or change its `reach` or `clearance`."
        if conflict.obstacle == "obstacle":
            x, y, z = after.position + conflict.share * (before.position - after.position)
            mend = f"That is near ({x:.2f}, {y:.2f}, {z:.2f})"
            if gap is not None and gap.width < 2.0 * gap.needed:
                sides = joined_names([f"'{name}'" for name in dict.fromkeys(gap.between)])
                mend += (
                    f", where it is {gap.width:.3f} m wide between {sides}, and a "
                    f"straight flight needs {gap.needed:.3f} m (radius and margin on both sides), one that turns more"
                )
            mend += ". Widen it, or lower `margin`."
        super().__init__(
            f"The spline through the control points {what} between {_name(after)} and {_name(before)}, "
            f"whichever points are added. {mend}"
        )

    def beside(self, mission: Mission, radius: float) -> SplineBlocked:
        """Return the error with how wide it is where the spline has no room.

        Args:
            mission: Gives the obstacles.
            radius: Of the vehicle, m.
        """
        space, conflict = FreeSpace.of(mission, radius), self.conflict
        if space is None or conflict.obstacle != "obstacle":
            return self
        a, b = (self.stops[conflict.piece + k].position for k in (0, 1))
        at = a + conflict.share * (b - a)
        return SplineBlocked(conflict, self.stops, narrowest(space, np.stack([at, at + _POINT])))


def _name(stop: Stop) -> str:
    return f"the {stop.role}{f' of {stop.region!r}' if stop.region else ''}"
