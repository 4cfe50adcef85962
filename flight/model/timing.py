"""The simulation's clock: how often is commanded, stepped and written down."""

from __future__ import annotations

CONTROL_STEP = 0.02
"""s between two commands: 50 Hz, as in the 2022 paper's experiment."""
SUBSTEPS = 10
"""Steps of the dynamics between two commands: 500 Hz."""
STEP = CONTROL_STEP / SUBSTEPS
"""s."""
FRAME_STEPS = 5
"""Steps of the dynamics between two entries of the log: 100 Hz."""
