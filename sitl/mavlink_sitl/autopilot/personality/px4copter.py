"""PX4 v1.17 for a multicopter, as it was recorded (`tlogs/px4`)."""

from __future__ import annotations

from mavlink_sitl.autopilot.personality import ModeSpec, Personality, px4
from mavlink_sitl.autopilot.personality.parameters import table
from mavlink_sitl.autopilot.personality.px4 import (
    CAPABILITIES,
    COMMON_PARAMETERS,
    available_modes,
    flown_modes,
    in_order,
)
from mavlink_sitl.autopilot.plans.plan_rules import PX4_PLANS
from mavlink_sitl.geodesy import PX4

_PARAMETERS = (*COMMON_PARAMETERS, *table("px4copter"))

_COPTERS_ONLY = (
    ModeSpec(px4.ORBIT, "ORBIT", "px4_orbit", True, base_flags=px4.BY_COMPUTER),
    ModeSpec(
        px4.FOLLOW_TARGET,
        "AUTO.FOLLOW_TARGET",
        "px4_follow_target",
        True,
        base_flags=px4.BY_COMPUTER,
    ),
)
"""Not to be armed in; not AUTO in base_mode, as sticks may change what they do (read in the
firmware)"""

PX4COPTER = Personality(
    name="PX4 multicopter",
    mav_type=2,
    mav_autopilot=12,
    capabilities=CAPABILITIES,
    flight_sw_version=17891583,
    flight_custom_version="d6f12ad1",
    modes={**flown_modes(needs_position=True), **{mode.number: mode for mode in _COPTERS_ONLY}},
    parameters=in_order(_PARAMETERS),
    whole="px4_copter",
    boot=(),
    ready_s=4.4,
    gps_fix_s=0.5,
    battery_ready_s=0.2,
    origin_s=3.8,
    first_heartbeat_s=0.16,
    standby_s=1.0,
    streams={},
    shortest_interval_us=1000,
    available_modes=available_modes(),
    plan_rules=PX4_PLANS,
    projection=PX4,
    kind="px4copter",
    armed_text="Armed by external command",
    disarmed_text="Disarmed by external command",
    says_impacts=False,
)
