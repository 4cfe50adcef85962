"""Simulate certified flights, watch them, compare them with recordings, and export them to real vehicles."""

from flight.air import Wind
from flight.airframe import Airframe, airframe_of, shipped_airframes
from flight.export import export
from flight.fly import fly
from flight.log import Event, FlightLog
from flight.sensing import MotionCapture

__all__ = [
    "Airframe",
    "Event",
    "FlightLog",
    "MotionCapture",
    "Wind",
    "airframe_of",
    "export",
    "fly",
    "shipped_airframes",
]
