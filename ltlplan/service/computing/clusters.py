"""Earlier place of `ltlplan.service.execution.clusters`."""

import warnings

from ltlplan.service.execution.clusters import *  # noqa: F403  # whatever was imported from here

warnings.warn(f"{__name__} is ltlplan.service.execution.clusters now.", DeprecationWarning, stacklevel=2)
