"""A link to vehicles that live in the laboratory's frame, spoken to in the mission's."""

from __future__ import annotations

import math

from flight.frames import in_laboratory
from flight.link.link import Link, Pose
from flight.link.wrapped import WrappedLink
from verify.data import Trajectory
from verify.data.frame import Frame


class FramedLink(WrappedLink):
    """Turns and moves what goes to vehicles, and what comes from them; all else is the link's own.

    Attributes:
        frame: Where the mission lies in the laboratory's frame, which is the link's.
    """

    def __init__(self, link: Link, frame: Frame) -> None:
        """Take a link.

        Args:
            link: To the vehicles, in the laboratory's frame.
            frame: Where the mission lies.
        """
        super().__init__(link)
        self.frame = frame

    def pose(self, robot: str) -> Pose | None:
        """Return the last pose, in the mission's frame."""
        pose = self.link.pose(robot)
        if pose is None:
            return None
        x, y, z = self.frame.to_mission(pose.position).tolist()
        turn = math.radians(self.frame.rotation_deg)
        looks = None if pose.heading is None else math.remainder(pose.heading - turn, math.tau)
        return Pose(pose.time, (x, y, z), looks, pose.unrest)

    def upload(self, robot: str, number: int, path: Trajectory) -> None:
        """Store a flight of the mission's frame on board.

        Args:
            robot: Name.
            number: From 0.
            path: Finite, in the mission's frame.
        """
        self.link.upload(robot, number, in_laboratory(self.frame, path)[0])

    def land(self, robot: str, height: float, seconds: float) -> bool:
        """Tell a robot to sink.

        Args:
            robot: Name.
            height: z in m of the mission where the landing ends.
            seconds: How long it takes.
        """
        return self.link.land(robot, height + self.frame.offset[2], seconds)
