"""PX4 for a multicopter: take-off and landing."""

from __future__ import annotations

from mavlink_sitl.autopilot.personality import px4
from mavlink_sitl.autopilot.px4.multicopter import copter_modes as modes
from mavlink_sitl.autopilot.px4.multicopter.copter_mission import Mission
from mavlink_sitl.autopilot.px4.multicopter.copter_navigation import CopterNavigator
from mavlink_sitl.autopilot.px4.multicopter.follow_target import FollowTarget
from mavlink_sitl.autopilot.px4.multicopter.orbit import Orbit, OrbitRequest
from mavlink_sitl.autopilot.px4.multicopter.precision_landing import PrecisionLanding
from mavlink_sitl.autopilot.px4.vehicle import Px4Vehicle, px4_table
from mavlink_sitl.exchange import Result, Severity, Vector
from mavlink_sitl.geodesy import GeoPoint

TAKEOFF_DETECTED_S = 0.7
"""From the begin of the motors' ramp; 1.5 s to 2.1 s after arming in the recordings"""
LANDED_AFTER_S = 1.0
"""LNDMC_TRIG_TIME: time on the ground after which it is landed"""
UNLOADED_S, UNLOADED_IN_RTL_S = 0.7, 5.0
"""From motors that push little on the ground to 'Landing detected'. From touching down that is
2.2 s in AUTO.LAND (`offboard_10m_20n_gt`, where the truth is known), 2.4 s in
`mavsdk_offboard_goto`; at the end of an AUTO.RTL 3.6 s to 12 s, mostly 5 s to 7 s
(`mission_clear`, `offboard_loss_stop`)"""


class Px4Copter(Px4Vehicle):
    """A multicopter with PX4."""

    navigator: CopterNavigator
    obeys_moved_sticks = True
    table = px4_table(
        modes={
            "px4_hold": modes.Hold,
            "px4_manual": modes.Manual,
            "px4_altitude": modes.Manual,
            "px4_position": modes.Manual,
            "px4_mission": Mission,
            "px4_return": modes.Return,
            "px4_offboard": modes.Offboard,
            "px4_takeoff": modes.Takeoff,
            "px4_land": modes.Land,
            "px4_orbit": Orbit,
            "px4_follow_target": FollowTarget,
            "px4_precland": PrecisionLanding,
        },
        navigator=CopterNavigator,
    )
    _left_ground = False

    def takes_off(self) -> bool:
        """Some time after the thrust began to rise."""
        self._left_ground = False
        return self.now_s - self.arming.lift_began_s >= TAKEOFF_DETECTED_S

    def has_landed(self) -> bool:
        """On the ground again, and not only between taking off and continuing in another mode.

        A take-off that was broken off before it left the ground is over when it is to land, or
        when the ramp of the motors has ended.
        """
        self._left_ground = self._left_ground or not self.landed
        flown_s = self.now_s - self.took_off_at_s
        ended = flown_s >= self.parameters["MPC_TKO_RAMP_T"] and not self.mode.taking_off
        over = self._left_ground or self.mode.landing or ended
        if not (over and self.landed and flown_s >= LANDED_AFTER_S):
            return False
        returned = self.mode.spec.number == px4.RTL
        unloaded_s = UNLOADED_IN_RTL_S if returned else UNLOADED_S
        return not self._left_ground or self.now_s - self.state.landing.since_s >= unloaded_s

    def orbit(self, wanted: OrbitRequest) -> Result:
        """DO_ORBIT: changes the mode, whatever is wrong with the circle."""
        if self.set_mode(px4.ORBIT) is not Result.ACCEPTED:
            self.say(Severity.CRITICAL, "Orbit command rejected")
            return Result.TEMPORARILY_REJECTED
        self.mode_of(Orbit).request(wanted)
        return Result.ACCEPTED

    def see_target(self, place: GeoPoint, velocity_ned_m_s: Vector | None) -> None:
        """FOLLOW_TARGET: where the target is, and how fast if it knows that; in any mode."""
        if not self.estimator.has_origin:
            return
        place_ned_m = self.navigator.place_ned_m(place)
        responsiveness = self.parameters["FLW_TGT_RS"]
        self.mode_of(FollowTarget).target.hear(
            self.now_s, place_ned_m, velocity_ned_m_s, responsiveness
        )

    def see_landing_target(self, place: Vector) -> None:
        """LANDING_TARGET: where it is, NED metres; in any mode."""
        self.mode_of(PrecisionLanding).hear(place)
