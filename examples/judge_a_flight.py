"""Judge words, and a flight that was recorded; nothing is planned and nothing but the judge is loaded."""

import numpy as np

import verify
from verify.data import parse_mission

for word in ([set(), {"a"}], [{"b"}, {"a"}]):
    verdict = verify.check_word("F a & G !b", word)
    print(f"{word}: {verdict.outcome}. {verdict.sentence}")

team = verify.check_team("!a U b", {"quad0": [set(), {"a"}], "quad1": [set(), {"b"}]})
print(f"one robot after another: {team.sequential.outcome}")

MISSION = """
format: 1
name: recorded
spec: {formula: "F a & G !b"}
regions: {a: {center: [1.0, 0.0, 1.0], radii: [0.2, 0.2, 0.2]}, b: {center: [0.5, 0.6, 1.0], radii: [0.2, 0.2, 0.2]}}
agents: {quad0: {start: [0.0, 0.0, 1.0]}}
vehicle: crazyflie-2.1
workspace: {min: [-1.5, -1.5, 0.2], max: [1.5, 1.5, 1.8]}
"""

mission = parse_mission(MISSION)
times = np.linspace(0.0, 4.0, 401)  # s; 100 samples a second, as motion capture gives
positions = np.stack([times / 4, 0.02 * np.sin(times), np.ones_like(times)], axis=1)  # m
for error in (0.001, 0.5):  # m, of the measurement
    verdict = verify.check_samples(times, positions, mission, max_speed=0.5, error=error)
    print(f"measured within {error} m: {verdict.outcome}. {verdict.sentence}")
