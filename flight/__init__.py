"""Simulation, monitoring, comparison and export of certified flights, and live flights over a link.

Read `flights` (one simulated flight), `campaigns` (many, in `batches`) and `rehearsal` (all combinations of conditions, and corners of what
`identification` does not tell). Each is flown in `conditions` (wind, sensors, model, controller; `condition_options` in words) and by `closed_loop`, in which `control` steers what
`model` moves. `onboard_simulation` is the software that vehicles carry; `simulation_setup` and `random_streams` serve both, and `mixed_fleet` several
airframes at once. `monitoring` checks in flight, `logs` reads and writes flights, and `comparison` compares recordings with a certificate. `exports`
writes files for vehicles, `link` flies live, and `frames` turns flights into the laboratory's frame. `certificate_checks` guards each entry point.
`pictures` draws (`figures` as plain data, over `shapes`), `processes` spreads work, and `storage` writes files and folders.
"""

from __future__ import annotations

from verify.data.names.loading import loaded_at_first_use

TYPE_CHECKING = False  # type checkers take it for True
if TYPE_CHECKING:
    from flight.campaigns import Campaign, Proportion, campaign
    from flight.certificate_checks import require_tube
    from flight.comparison import Comparison, compare
    from flight.conditions import Conditions, conditions_of
    from flight.control.controller import Controller
    from flight.exports import Exported, ExportTarget, Product, Request, export, formats, quantised, upload, with_hovers
    from flight.exports.crazyflies.crazyswarm import crazyswarm2_robots
    from flight.flights import fly
    from flight.identification.identify import Identified, identify
    from flight.identification.recorded import read_recorded
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
    "Identified",
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
    "crazyswarm2_robots",
    "export",
    "fly",
    "formats",
    "identify",
    "quantised",
    "read_flown",
    "read_log",
    "read_recorded",
    "read_recording",
    "rehearse",
    "require_tube",
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
            "flight.certificate_checks": ("require_tube",),
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
            "flight.exports.crazyflies.crazyswarm": ("crazyswarm2_robots",),
            "flight.flights": ("fly",),
            "flight.identification.identify": ("Identified", "identify"),
            "flight.identification.recorded": ("read_recorded",),
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
