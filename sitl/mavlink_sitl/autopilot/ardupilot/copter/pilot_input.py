"""A copter's sticks as its modes take them: lean, rate of turn, climb rate and thrust.

As `Mode` and `Attitude` of ArduCopter have them. A radio that is lost leaves all in the middle.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from mavlink_sitl.exchange import YawMode

if TYPE_CHECKING:
    from mavlink_sitl.autopilot.common.commander import Commander

MOST_LEAN_RAD = math.radians(85.0)
MOST_DEAD_ZONE = 0.4
THROTTLE_CURVE = 0.375
"""Of a hover at mid-stick: how the curve of the throttle bends for one at less"""

Lean = tuple[float, float]
"""Tangents of the thrust's lean, forward and right, or north and east"""


def lean_limit_rad(copter: Commander) -> float:
    """ANGLE_MAX."""
    return min(max(math.radians(copter.parameters["ANGLE_MAX"] / 100.0), 0.0), MOST_LEAN_RAD)


def lean(copter: Commander, most_rad: float) -> Lean:
    """The lean of the roll and pitch sticks, north and east."""
    steepest = math.tan(most_rad)
    forward = -steepest * copter.radio.stick("Pitch", copter.now_s)
    right = steepest * copter.radio.stick("Roll", copter.now_s)
    scale = steepest / max(math.hypot(forward, right), steepest, 1e-6)
    return turned((forward * scale, right * scale), copter.motion.yaw_rad)


def turned(level: Lean, yaw_rad: float) -> Lean:
    """Forward and right to north and east, for a nose that points there."""
    c, s = math.cos(yaw_rad), math.sin(yaw_rad)
    return level[0] * c - level[1] * s, level[0] * s + level[1] * c


def yaw(copter: Commander) -> tuple[YawMode, float]:
    """The turn rate of the yaw stick, rad/s (PILOT_Y_RATE); in its middle the heading is held."""
    stick = copter.radio.stick("Yaw", copter.now_s)
    rate = stick * math.radians(copter.parameters["PILOT_Y_RATE"])
    return (YawMode.RATE if rate else YawMode.HOLD), rate


def climb_rate_m_s(copter: Commander) -> float:
    """The climb rate of the throttle stick where height is held; positive is up."""
    if not copter.radio.obeyed(copter.now_s):
        return 0.0
    p = copter.parameters
    up = p["PILOT_SPEED_UP"] / 100.0
    down = (p["PILOT_SPEED_DN"] or p["PILOT_SPEED_UP"]) / 100.0
    middle = copter.radio.calibration("Throttle").middle()
    dead_zone = min(max(p["THR_DZ"] / 1000.0, 0.0), MOST_DEAD_ZONE)
    stick = copter.radio.throttle(copter.now_s)
    low, high = middle - dead_zone, middle + dead_zone
    if stick < low:
        return down * (stick - low) / low
    return up * (stick - high) / (1.0 - high) if stick > high else 0.0


def thrust(copter: Commander) -> float:
    """The throttle stick's share of the full thrust: mid-stick is MOT_THST_HOVER."""
    stick = copter.radio.throttle(copter.now_s)
    middle = copter.radio.calibration("Throttle").middle() or 0.5
    if stick < middle:
        stick = 0.5 * stick / middle
    else:
        stick = 0.5 + 0.5 * (stick - middle) / (1.0 - middle)
    hover = copter.parameters["MOT_THST_HOVER"]
    bend = min(max((0.5 - hover) / THROTTLE_CURVE, -0.5), 1.0)
    return stick * (1.0 - bend) + bend * stick**3
