"""Missions with one hoop or some, and one over plain regions, for the tests of courses."""

from collections.abc import Iterable

from verify.data import Mission, parse_mission


def small_mission(**changes: str) -> Mission:
    """Return a mission with one hoop to fly through; `changes` are texts of YAML."""
    base = {
        "hoops": "h0: {center: [0, 0, 1], yaw_deg: 0, radii: [0.2, 0.2, 0.2], opening: 0.25, rim: 0.02}",
        "agents": "quad0: {start: [-1.2, 0, 1]}",
        "sequence": "h0F",
        "workspace": "{min: [-2, -2, 0.2], max: [2, 2, 2]}",
        "spec": "{trace: finite}",
    }
    base.update(changes)
    text = "format: 1\nname: small\nvehicle: crazyflie-2.1\n"
    text += f"sequence: {base['sequence']}\nspec: {base['spec']}\nworkspace: {base['workspace']}\n"
    text += "hoops:\n" + "".join(f"  {line}\n" for line in base["hoops"].split("\n"))
    text += "agents:\n  " + base["agents"] + "\n"
    return parse_mission(text)


def crowded(places: Iterable[tuple[float, float, float, float]], **changes: str) -> Mission:
    """Return a mission with a hoop at each (x, y, z, yaw), in m and degrees."""
    hoops = "\n".join(
        f"h{i}: {{center: [{x:.3f}, {y:.3f}, {z:.3f}], yaw_deg: {yaw:.1f}, radii: [0.2, 0.2, 0.2], opening: 0.25, rim: 0.02}}"
        for i, (x, y, z, yaw) in enumerate(places)
    )
    return small_mission(hoops=hoops, agents="quad0: {start: [-1.8, -1.8, 0.4]}", **changes)


REGIONS = """
format: 1
name: regions
spec: {{formula: G F a & G F b, trace: infinite}}
regions:
  a: {{center: [0, 0, 1], radii: [0.3, 0.2, 0.2]}}
  b: {{center: [1, 0.5, 1], radii: [0.2, 0.2, 0.2]}}
agents: {{quad0: {{start: {start}}}}}
vehicle: crazyflie-2.1
workspace: {{min: [-2, -2, 0.2], max: [2, 2, 2]}}
"""
"""A mission over two plain regions; `start` is to be filled in."""
