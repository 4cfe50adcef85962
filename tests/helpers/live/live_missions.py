"""Small missions for flights over links."""

HOP = """
format: 1
name: hop
spec: {formula: F ahead}
regions:
  ahead: {center: [0.3, 0.0, 0.3], radii: [0.2, 0.2, 0.2]}
agents:
  one: {start: [0.0, -0.5, 0.3]}
vehicle: crazyflie-2.1
workspace: {min: [-2.0, -2.0, 0.2], max: [2.0, 2.0, 2.0]}
margin: 0.09
"""
"""One robot, and one region ahead of it."""


def pair(left: str, right: str, *, floor: float = 0.3, more: str = "") -> str:
    """Return a mission of two robots that fly to a region each.

    Args:
        left: Middle of the one's, as in a mission's text.
        right: Middle of the other's.
        floor: Where the workspace begins, m.
        more: Lines that follow.
    """
    return f"""
format: 1
name: pair
spec: {{formula: F left & F right}}
regions:
  left: {{center: {left}, radii: [0.25, 0.25, 0.25]}}
  right: {{center: {right}, radii: [0.25, 0.25, 0.25]}}
agents:
  one: {{start: [-1.0, -0.5, 1.0]}}
  two: {{start: [1.0, -0.5, 1.0]}}
vehicle: crazyflie-2.1
workspace: {{min: [-2.0, -2.0, {floor}], max: [2.0, 2.0, 2.0]}}
{more}
"""


PAIR = pair("[-1.0, 0.4, 1.0]", "[1.0, 0.4, 1.4]")
"""Two robots, the one's region lower than the other's."""

WIDE_HOP = """
format: 1
name: wide hop
spec: {formula: F ahead}
regions:
  ahead: {center: [0.5, 0.3, 0.6], radii: [0.4, 0.4, 0.4]}
agents:
  one: {start: [0.0, -0.5, 0.6]}
vehicle: crazyflie-2.1
workspace: {min: [-2.0, -2.0, 0.2], max: [2.0, 2.0, 2.0]}
margin: 0.25
"""
"""The same with a margin for poses of a machine that is late."""
