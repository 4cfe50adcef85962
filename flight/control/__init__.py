"""Controllers: from a plan and a vehicle's estimated state to commands.

`controller` is their protocol and registry; each has a file of its own. On the ground: `geometric` and `paper`, over `flatness` (thrust, attitude and
rates of a plan). On board, as the Crazyflie has them: `mellinger`, `pid` and `lee`, over `onboard_controller`; `px4` has PX4's cascade. `streamed` has another one fly on
set-points that are late and rounded. `profiles` reads the entries of a vehicle's profile.
"""
