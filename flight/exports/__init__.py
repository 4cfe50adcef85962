"""Export of certified flights to real vehicles. What is not certified, or does not fit, is rejected.

`writer` is the door; `target` says what a target is and lists them. Each has a file of its own that turns a team into the contents of
files; nothing is written before all of them are made. Every export carries the certificate's digest and a note (`notes`) of what
would void it.
Those for Crazyflies are in the room `crazyflies`; `parts` and `braking` are what is uploaded of flights that vehicles do not hold at once and
behind last laps, `flown` is who flew it in simulation before. `vertical_corridors` proves climb and landing, and `bundled_scripts` has the scripts in the room `scripts`
and the numbers that they fly by.
`px4` (with `px4_parameters`) and `ros` are targets in one module each.
"""

from __future__ import annotations

from verify.data.names.loading import loaded_at_first_use

TYPE_CHECKING = False  # type checkers take it for True
if TYPE_CHECKING:
    from flight.exports.crazyflies.compressed import quantised
    from flight.exports.crazyflies.crazyflie import upload
    from flight.exports.crazyflies.crazyswarm import with_hovers
    from flight.exports.target import ExportTarget, Product, Request
    from flight.exports.writer import Exported, export, formats

__all__ = ["ExportTarget", "Exported", "Product", "Request", "export", "formats", "quantised", "upload", "with_hovers"]

if not TYPE_CHECKING:  # which know all names from above, so that a misspelt one is an error to them
    __getattr__, __dir__ = loaded_at_first_use(
        __name__,
        {
            "flight.exports.crazyflies.compressed": ("quantised",),
            "flight.exports.crazyflies.crazyflie": ("upload",),
            "flight.exports.crazyflies.crazyswarm": ("with_hovers",),
            "flight.exports.writer": ("Exported", "export", "formats"),
            "flight.exports.target": ("ExportTarget", "Product", "Request"),
        },
    )
