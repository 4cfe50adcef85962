"""Missions with one hoop, in regions of all shapes."""

from __future__ import annotations

from verify.data import Mission, parse_mission

SHAPES = {
    "box": "size: [0.5, 0.6, 0.5]",
    "cylinder": "cylinder: {radius: 0.3, height: 0.6}",
    "prism": "prism: {polygon: [[-0.3, -0.3], [0.3, -0.2], [0.2, 0.5], [-0.35, 0.4]], z: [0.7, 1.6]}",
    "union": "union: [{center: [-0.15, 0.1, 1.1], size: [0.5, 0.7, 0.8]}, {center: [0.25, 0.2, 1.1], size: [0.3, 0.5, 0.7]}]",
}


def gate(radii: list[float], opening: float, *, yaw: float = 0.0, margin: float = 0.05, pitch: float = 0.0) -> Mission:
    return parse_mission(f"""
format: 1
name: gate
spec: {{formula: "F a & F goal"}}
hoops: {{a: {{center: [0, 0.1, 1.1], yaw_deg: {yaw}, pitch_deg: {pitch}, radii: {radii}, opening: {opening}, rim: 0.02, reach: 0.4}}}}
regions: {{goal: {{center: [1.2, -0.7, 0.8], radii: [0.2, 0.2, 0.2]}}}}
agents: {{q: {{start: [-1.2, -0.6, 0.7]}}}}
vehicle: crazyflie-2.1
workspace: {{min: [-1.6, -1.6, 0.2], max: [1.6, 1.6, 2.0]}}
margin: {margin}
""")


def gate_of(shape: str, *, yaw: float, pitch: float = 0.0, reach: float = 0.65, formula: str = "F a & F goal") -> Mission:
    return parse_mission(f"""
format: 1
name: gate
spec: {{formula: "{formula}"}}
hoops: {{a: {{center: [0, 0.1, 1.1], yaw_deg: {yaw}, pitch_deg: {pitch}, {shape}, opening: 0.3, rim: 0.02, reach: {reach}}}}}
regions: {{goal: {{center: [1.2, -0.7, 0.8], radii: [0.2, 0.2, 0.2]}}}}
agents: {{q: {{start: [-1.2, -0.6, 0.7]}}}}
vehicle: crazyflie-2.1
workspace: {{min: [-1.6, -1.6, 0.2], max: [1.6, 1.6, 2.0]}}
""")
