"""Simulate certified flights, watch them, compare them with recordings, and export them to real vehicles.

`flights` flies once and `campaigns` many times (in `batches`), both in `conditions` (wind, sensors, model, controller) and by
`closed_loop`, which lets `control` steer what `model` moves. `monitoring` judges while flying, `logs` keeps what happened,
`comparison` holds it against a certificate, `exports` writes for real vehicles, and `pictures` draws (over `shapes`). `certified` is
asked at every door; `processes` shares work.
"""

from flight.campaigns import Campaign, Share, campaign
from flight.comparison import Comparison, compare
from flight.conditions import Conditions
from flight.control.controller import Controller
from flight.exports import Exported, ExportTarget, Product, Request, export, formats, quantised, upload, with_hovers
from flight.flights import fly
from flight.logs.log import Event, FlightLog
from flight.logs.recordings import Recording, read_recording
from flight.logs.tables import read_log, write_log
from flight.model.airframe import Airframe, airframe_of, shipped_airframes
from flight.model.disturbances import Wind
from flight.model.plant import AirframeModel
from flight.model.sensing import MotionCapture
from flight.monitoring.monitor import Monitor

__all__ = [
    "Airframe",
    "AirframeModel",
    "Campaign",
    "Comparison",
    "Conditions",
    "Controller",
    "Event",
    "ExportTarget",
    "Exported",
    "FlightLog",
    "Monitor",
    "MotionCapture",
    "Product",
    "Recording",
    "Request",
    "Share",
    "Wind",
    "airframe_of",
    "campaign",
    "compare",
    "export",
    "fly",
    "formats",
    "quantised",
    "read_log",
    "read_recording",
    "shipped_airframes",
    "upload",
    "with_hovers",
    "write_log",
]
