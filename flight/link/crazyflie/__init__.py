"""The links to Crazyflies by cflib: what flies is stored on board, and started by all at once, or streamed from here.

`link` is the link's kind, and `streamed` the one whose flights can be changed while they are flown, by `setpoints` as the radio has them, which
`aim` sends and ends; `vehicle` is one Crazyflie, and the only door to cflib here but for `reports`, what it says of itself, and `broadcast`,
by which all of one radio channel are started at one instant. `packets` are what cflib has no call for, `steps` is what takes a while, such as to
connect; `memory` lays flights side by side on board, `setting` is what is set there and read back, and `capture` are poses of motion
capture, sent to the vehicles as they come.
"""

from __future__ import annotations
