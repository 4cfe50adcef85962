"""Earlier place of `ltlplan.paths.cross_entropy.cross_entropy`."""

import warnings

from ltlplan.paths.cross_entropy.cross_entropy import *  # noqa: F403  # whatever was imported from here

warnings.warn(f"{__name__} is ltlplan.paths.cross_entropy.cross_entropy now.", DeprecationWarning, stacklevel=2)
