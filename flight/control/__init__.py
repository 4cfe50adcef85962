"""Controllers: from a plan and what is known of the vehicles to commands.

`controller` says what a controller is and lists them; each has a file of its own. `flatness` turns a plan into thrust, attitude and
rates for those on the ground; `onboard_controller` is what those on board have in common, `profiles` what a
vehicle's profile says of them.
The controllers are `geometric` and `paper` on the ground; `mellinger`, `pid` and `lee` as the Crazyflie has them on board.
"""
