"""PX4 for a fixed-wing aeroplane: takes off from a runway, loiters in circles, cannot hover.

Rules read in the source of v1.17 (fw_mode_manager, FixedwingLandDetector, Commander, Navigator).
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

from mavlink_sitl.autopilot.common.commander import PowerUp
from mavlink_sitl.autopilot.common.firmware import Inputs, Landing
from mavlink_sitl.autopilot.personality import px4
from mavlink_sitl.autopilot.plans.plans import Cmd, PlanItem
from mavlink_sitl.autopilot.px4.navigation import Px4Navigator, within
from mavlink_sitl.autopilot.px4.plane import plane_landing, plane_modes, plane_takeoff
from mavlink_sitl.autopilot.px4.plane.path_guidance import Law, Point
from mavlink_sitl.autopilot.px4.plane.plane_mission import PlaneMission, approach_is_good
from mavlink_sitl.autopilot.px4.plane.plane_modes import TRUE_OVER_INDICATED, PlaneOffboard
from mavlink_sitl.autopilot.px4.vehicle import Px4Vehicle, px4_table
from mavlink_sitl.autopilot.state.navigation import LEAST_LIMIT
from mavlink_sitl.exchange import Limits, Observation, Result
from mavlink_sitl.geodesy import GeoPoint


class PlaneNavigator(Px4Navigator):
    """Origin, home and speed of a plane."""

    def cruise_m_s(self) -> float:
        """The indicated airspeed it keeps: FW_AIRSPD_TRIM, or what DO_CHANGE_SPEED said."""
        p = self._parameters
        wanted = self._speed_xy_m_s or p["FW_AIRSPD_TRIM"]
        return max(min(max(wanted, p["FW_AIRSPD_MIN"]), p["FW_AIRSPD_MAX"]), LEAST_LIMIT)

    def limits(self) -> Limits:
        """Only the speed means something."""
        return Limits(speed_xy_m_s=self.cruise_m_s())


def _landed_when_slow(landing: Landing, inputs: Inputs) -> Landing:
    """Flying at once when fast, also while it rolls; landed when slow for LNDFW_TRIG_TIME."""
    p, observation = inputs.parameters, inputs.observation
    airspeed_m_s = observation.indicated_m_s(TRUE_OVER_INDICATED)
    fast = observation.motion.speed_m_s > p["LNDFW_VEL_XY_MAX"] or (
        airspeed_m_s > p["LNDFW_AIRSPD_MAX"] and not observation.touching_ground
    )
    if not inputs.armed:
        return landing.become(observation.touching_ground, observation.time_s)
    if landing.landed:
        return landing.become(not fast, observation.time_s)
    return landing.after(p["LNDFW_TRIG_TIME"], observation.time_s, not fast)


class Px4Plane(Px4Vehicle):
    """An aeroplane with PX4.

    Attributes:
        airspeed_m_s: indicated.
        circling: the centre and the radius of the circle that it flies, if it flies one.
    """

    navigator: PlaneNavigator
    table = px4_table(
        modes={
            "px4_hold": plane_modes.Hold,
            "px4_manual": plane_modes.Manual,
            "px4_altitude": plane_modes.Altitude,
            "px4_position": plane_modes.Altitude,
            "px4_mission": PlaneMission,
            "px4_return": plane_landing.Return,
            "px4_offboard": PlaneOffboard,
            "px4_takeoff": plane_takeoff.Takeoff,
            "px4_land": plane_landing.Land,
        },
        navigator=PlaneNavigator,
        landing=_landed_when_slow,
    )

    def __init__(self, start: PowerUp) -> None:
        self.airspeed_m_s = 0.0
        self.circling: tuple[Point, float] | None = None
        super().__init__(start)

    # State.

    def observe(self, observation: Observation) -> None:
        """See `Commander`; takes the airspeed."""
        super().observe(observation)
        self.airspeed_m_s = observation.indicated_m_s(TRUE_OVER_INDICATED)

    def may_land_by(self, items: Sequence[PlanItem]) -> bool:
        """See `Px4Vehicle`: what comes before a landing must suit FW_LND_ANG."""
        auto, here = self.auto, self.motion[:3]
        return all(
            approach_is_good(self, before, auto.place_of(before, here), auto.place_of(item, here))
            for before, item in pairwise(items)
            if item.command == Cmd.LAND and before.has_place
        )

    def takeoff_m_s(self) -> float:
        """FW_TKO_AIRSPD, or FW_AIRSPD_MIN."""
        return self._or_slowest("FW_TKO_AIRSPD")

    def landing_m_s(self) -> float:
        """FW_LND_AIRSPD, or FW_AIRSPD_MIN."""
        return self._or_slowest("FW_LND_AIRSPD")

    def _or_slowest(self, name: str) -> float:
        p = self.parameters
        return within(p[name] if p[name] > 0.0 else p["FW_AIRSPD_MIN"], 1.0, 100.0)

    def law(self) -> Law:
        """NPFG_PERIOD and NPFG_DAMPING."""
        p = self.parameters
        return Law(within(p["NPFG_PERIOD"], 1.0, 100.0), within(p["NPFG_DAMPING"], 0.1, 1.0))

    def orbit(
        self, point: GeoPoint | None, altitude_amsl_m: float | None, radius_m: float | None
    ) -> Result:
        """DO_ORBIT: AUTO.LOITER round a place, or where it is; negative is counter-clockwise."""
        self.intend(px4.LOITER)
        if self.armed:
            self.mode_of(plane_modes.Hold).go_round(point, altitude_amsl_m, radius_m)
        return Result.ACCEPTED

    def loiter_radius_m(self) -> float:
        """NAV_LOITER_RAD; negative is counter-clockwise."""
        return within(self.parameters["NAV_LOITER_RAD"], -1e4, 1e4)

    def accept_m(self) -> float:
        """The acceptance radius of a waypoint: NAV_ACC_RAD, or where the next course begins."""
        motion, p = self.motion, self.parameters
        speed = motion.speed_m_s
        switch = within(p["NPFG_SW_DST_MLT"], 0.0, 1.0) * self.law().bound_m(speed)
        return within(max(p["NAV_ACC_RAD"], min(switch, 500.0)), 1.0, 1e4)

    def height_accept_m(self) -> float:
        """NAV_FW_ALT_RAD."""
        return within(self.parameters["NAV_FW_ALT_RAD"], 0.5, 1e4)
