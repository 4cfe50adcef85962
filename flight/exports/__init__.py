"""Export of certified flights to real vehicles. What is not certified, or does not fit, is refused.

Each format has a module of its own that turns a team into the contents of files; nothing is written before all of
them are made. Every export carries the certificate's digest and a note of what would void it.
"""

from flight.exports.compressed import quantised
from flight.exports.crazyflie import upload
from flight.exports.crazyswarm import with_hovers
from flight.exports.files import Exported, export, formats

__all__ = ["Exported", "export", "formats", "quantised", "upload", "with_hovers"]
