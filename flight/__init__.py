"""Simulation, monitoring, comparison and export of certified flights, and live flights over a link.

`flights` flies once and `campaigns` many times (in `batches`), both in `conditions` (wind, sensors, model, controller) and by
`closed_loop`, which lets `control` steer what `model` moves (`onboard_simulation` for what vehicles carry; `simulation_setup` and `random_streams` are common to both). `rehearsal` flies under everything that may be otherwise. `monitoring` judges while flying, `logs` keeps what happened,
`comparison` holds it against a certificate, `exports` writes for real vehicles, and `pictures` draws (over `shapes`). `certificate_checks` is
asked at every door; `processes` shares work; `storage` writes files and folders.
`frames` turns certified flights into the laboratory's frame, `mixed_fleet` simulates several airframes at once, and `link` flies live.
"""

from __future__ import annotations

from verify.data.loading import loaded_at_first_use

TYPE_CHECKING = False  # type checkers take it for True
if TYPE_CHECKING:
    from flight.campaigns import Campaign, Proportion, campaign
    from flight.comparison import Comparison, compare
    from flight.conditions import Conditions, conditions_of
    from flight.control.controller import Controller
    from flight.exports import Exported, ExportTarget, Product, Request, export, formats, quantised, upload, with_hovers
    from flight.flights import fly
    from flight.logs.import_options import RecordingOptions
    from flight.logs.importers import read_flown, read_recording
    from flight.logs.log import Event, FlightLog
    from flight.logs.recordings import Recording
    from flight.logs.tables import read_log, write_log
    from flight.model.airframe import Airframe, airframe_of, shipped_airframes
    from flight.model.disturbances import Wind
    from flight.model.plant import AirframeModel
    from flight.model.sensing import MotionCapture
    from flight.monitoring.monitor import Monitor
    from flight.rehearsal.combinations import Combinations, rehearse
    from flight.rehearsal.table import Cell, Rehearsal

__all__ = [
    "Airframe",
    "AirframeModel",
    "Campaign",
    "Cell",
    "Combinations",
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
    "Proportion",
    "Recording",
    "RecordingOptions",
    "Rehearsal",
    "Request",
    "Wind",
    "airframe_of",
    "campaign",
    "compare",
    "conditions_of",
    "export",
    "fly",
    "formats",
    "quantised",
    "read_flown",
    "read_log",
    "read_recording",
    "rehearse",
    "shipped_airframes",
    "upload",
    "with_hovers",
    "write_log",
]

if not TYPE_CHECKING:  # which know all names from above, so that a misspelt one is an error to them
    __getattr__, __dir__ = loaded_at_first_use(
        __name__,
        {
            "flight.campaigns": ("Campaign", "Proportion", "campaign"),
            "flight.comparison": ("Comparison", "compare"),
            "flight.conditions": ("Conditions", "conditions_of"),
            "flight.control.controller": ("Controller",),
            "flight.exports": (
                "Exported",
                "ExportTarget",
                "Product",
                "Request",
                "export",
                "formats",
                "quantised",
                "upload",
                "with_hovers",
            ),
            "flight.flights": ("fly",),
            "flight.logs.log": ("Event", "FlightLog"),
            "flight.logs.importers": ("read_flown", "read_recording"),
            "flight.logs.recordings": ("Recording",),
            "flight.logs.tables": ("read_log", "write_log"),
            "flight.logs.import_options": ("RecordingOptions",),
            "flight.model.airframe": ("Airframe", "airframe_of", "shipped_airframes"),
            "flight.model.disturbances": ("Wind",),
            "flight.model.plant": ("AirframeModel",),
            "flight.model.sensing": ("MotionCapture",),
            "flight.monitoring.monitor": ("Monitor",),
            "flight.rehearsal.combinations": ("Combinations", "rehearse"),
            "flight.rehearsal.table": ("Cell", "Rehearsal"),
        },
        Share="Proportion",
        Told="RecordingOptions",
    )
