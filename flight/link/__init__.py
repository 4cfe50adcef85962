"""Live flights: a certified team flown over a link to vehicles, watched, and brought to a safe end on every way out.

`link` says what a link is; `simulated` is one to our own simulation, with the commander that flies on board in `simulated_commander`. `preflight_checks` are
asked before anything spins, `phases` is what is flown one after another, `live_executive` flies it under `tracking_monitor`,
and `record` is what is kept of it. `observed_link` shows a flight to others while it flies, and `stop_orders` are what they may order it; `holding` is the
first of these.
`crazyflie` and `mavlink` (of many a `px4_vehicle`) are links to vehicles: `addresses` says where each robot is reached, `framed` speaks in the laboratory's frame (as `observed_link`, it is `wrapped` around another link),
and `streaming` keeps the clock of set-points.
"""

from __future__ import annotations
