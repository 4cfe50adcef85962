"""Simulate certified flights, watch them, compare them with recordings, and export them to real vehicles."""

from flight.air import Wind
from flight.airframe import Airframe, airframe_of, shipped_airframes
from flight.campaign import Campaign, Share, campaign
from flight.compare import Comparison, compare
from flight.export import Exported, export, formats, quantised, upload, with_hovers
from flight.fly import fly
from flight.log import Event, FlightLog
from flight.monitor import Monitor
from flight.recording import Recording, read_recording
from flight.sensing import MotionCapture
from flight.tables import read_log, write_log

__all__ = [
    "Airframe",
    "Campaign",
    "Comparison",
    "Event",
    "Exported",
    "FlightLog",
    "Monitor",
    "MotionCapture",
    "Recording",
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
