"""The numeric half for multicopters with PX4: other laws, other gains, another drag.

Part of `simulation` (the same layer).
"""

from __future__ import annotations

from mavlink_sitl.autopilot.control.control_state import ControllerGains
from mavlink_sitl.autopilot.px4.multicopter import position_law
from mavlink_sitl.dynamics.quadrotor import QuadrotorModel
from mavlink_sitl.physics.copter_pipeline import Physics

BODY = QuadrotorModel(
    drag_linear_1_s=1.0,
    drag_quadratic_1_m=0.0,
    attitude_rate_rad_s=6.0,
    attitude_damping=1.0,
    max_lean=1.0,
)
"""The real simulator's own quadrotor: its drag grows with speed (SIH_KDV over SIH_MASS), and its
attitude follows MC_PITCH_P (6.5) and the rate loop behind it. Fitted to legs of 5, 15, 20 and
30 m in OFFBOARD: 0.9, 2.5, 4.1, 5.5 and 6.5 m/s after 0.3, 0.6, 0.9, 1.2 and 1.5 s"""
UNFILTERED_HZ = 1e3
GAINS = ControllerGains(
    position_xy=0.95,
    velocity_xy=1.8,
    velocity_xy_i=0.4,
    velocity_xy_d=0.0,
    filter_xy_hz=UNFILTERED_HZ,
    velocity_z=4.0,
    velocity_z_i=2.0,
    filter_z_hz=UNFILTERED_HZ,
    direct_push_z=True,
    restart_keeps_lean=False,
    max_lean=1.0,
    most_faster_m_s=20.0,
)
"""MPC_XY_P, MPC_XY_VEL_P_ACC, MPC_XY_VEL_I_ACC, MPC_Z_VEL_P_ACC, MPC_Z_VEL_I_ACC, MPC_TILTMAX_AIR
(45 degrees). MPC_XY_VEL_D_ACC stands in the law of OFFBOARD."""


class Px4Physics(Physics):
    """`Physics` with PX4's laws and the body that they were recorded with."""

    body_model = BODY
    gains = GAINS
    over_ground = staticmethod(position_law.horizontal)
