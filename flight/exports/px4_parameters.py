"""Parameters of PX4 that decide how it flies, as a vehicle's autopilot table has them."""

from __future__ import annotations

from flight.control.profiles import autopilot_of_vehicle, controller_name
from verify.data import Vehicle
from verify.data.autopilot import Px4Gains

TAKEN_FOR_GRANTED = {
    "MC_ROLLRATE_K": 1.0,
    "MC_PITCHRATE_K": 1.0,
    "MC_YAWRATE_K": 1.0,
    "MC_ROLLRATE_FF": 0.0,
    "MC_PITCHRATE_FF": 0.0,
    "MC_YAWRATE_FF": 0.0,
    "MC_BAT_SCALE_EN": 0.0,
    "MPC_ACC_DECOUPLE": 1.0,
    "MPC_USE_HTE": 1.0,
    "MPC_VEL_LP": 0.0,
    "MPC_VEL_NF_FRQ": 0.0,
}
"""Defaults of PX4 that the laws here are written for: factors of gains, feed-forward of rates, filters of the velocity, the thrust's estimate."""


def px4_parameters(vehicle: Vehicle) -> dict[str, float]:
    """Return what must stand on board for a flight by `px4` to be the one that was simulated; nothing for other controllers.

    Args:
        vehicle: Its profile.
    """
    if controller_name(vehicle) != "px4":
        return {}
    gains = autopilot_of_vehicle(vehicle).gains(Px4Gains)
    found = {
        **TAKEN_FOR_GRANTED,
        "MPC_XY_P": gains.position[0],
        "MPC_Z_P": gains.position[2],
        "MPC_XY_VEL_P_ACC": gains.velocity[0],
        "MPC_Z_VEL_P_ACC": gains.velocity[2],
        "MPC_XY_VEL_I_ACC": gains.velocity_integral[0],
        "MPC_Z_VEL_I_ACC": gains.velocity_integral[2],
        "MPC_XY_VEL_D_ACC": gains.velocity_change[0],
        "MPC_Z_VEL_D_ACC": gains.velocity_change[2],
        "MPC_VELD_LP": gains.velocity_change_cutoff,
        "MPC_XY_VEL_MAX": gains.speed_limit,
        "MPC_Z_VEL_MAX_UP": gains.climb_limit,
        "MPC_Z_VEL_MAX_DN": gains.descent_limit,
        "MPC_TILTMAX_AIR": gains.tilt_limit,
        "MPC_THR_MIN": gains.thrust_least,
        "MPC_THR_MAX": gains.thrust_most,
        "MPC_THR_XY_MARG": gains.thrust_sideways,
        "MC_YAW_WEIGHT": gains.yaw_weight,
        "MC_YAW_TQ_CUTOFF": gains.yaw_cutoff,
        "IMU_GYRO_CUTOFF": gains.gyro_cutoff,
        "IMU_DGYRO_CUTOFF": gains.gyro_change_cutoff,
        "THR_MDL_FAC": gains.thrust_curve,
    }
    for axis, (name, short) in enumerate((("ROLL", "RR"), ("PITCH", "PR"), ("YAW", "YR"))):
        found |= {
            f"MC_{name}_P": gains.angle[axis],
            f"MC_{name}RATE_MAX": gains.rate_limit[axis],
            f"MC_{name}RATE_P": gains.rate[axis],
            f"MC_{name}RATE_I": gains.rate_integral[axis],
            f"MC_{name}RATE_D": gains.rate_change[axis],
            f"MC_{short}_INT_LIM": gains.rate_integral_limit[axis],
        }
    return found
