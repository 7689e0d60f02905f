"""AUTO.FOLLOW_TARGET of PX4's multicopters: keeps a place relative to who sends FOLLOW_TARGET.

Read in the firmware (FlightTaskAutoFollowTarget, TargetEstimator). Of these are left out: the
sticks, which would change distance, height and angle; the accelerations of the target; the climb
out of less than a metre above the ground.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

from mavlink_sitl.autopilot.px4.multicopter.copter_modes import CopterMode
from mavlink_sitl.autopilot.px4.navigation import within
from mavlink_sitl.exchange import ZERO, Guidance, Motors, Vector, YawMode

if TYPE_CHECKING:
    from mavlink_sitl.autopilot.personality import ModeSpec
    from mavlink_sitl.autopilot.px4.multicopter.copter import Px4Copter

STALE_S = 3.0
"""A target that has been silent for this long counts as standing still"""
COURSE_M_S = 1.0
"""A slower target has no course; the last one counts"""
CLIMB_FIRST_M = 3.0
"""It climbs or sinks to within this of the wanted height before it follows over ground"""
LEAST_TO_LOOK_M = 1.0
RELATIVE_TO_GROUND, RELATIVE_TO_TARGET = 1, 2
"""FLW_TGT_ALT_M; 0 is relative to home"""


class Target:
    """The estimate of where the target is: measurements, and its velocity in between.

    Attributes:
        place: NED metres; None before the first measurement.
        velocity: NED m/s.
    """

    place: Vector | None = None
    velocity: Vector = ZERO
    _heard_s = -math.inf
    _moved_s = -math.inf

    def hear(
        self, now_s: float, place: Vector, velocity: Vector | None, responsiveness: float
    ) -> None:
        """Take a measurement.

        Args:
            now_s: when.
            place: NED metres.
            velocity: NED m/s; None where the target does not know it.
            responsiveness: FLW_TGT_RS: the share of the estimate that stays.
        """
        stays = within(responsiveness, 0.1, 1.0)
        if self.place is None:
            self.place, self.velocity = place, velocity or ZERO
        else:
            self.move(now_s)
            wait_s = max(now_s - self._heard_s, 1e-3)
            beta = stays ** (1.0 / 3.0)
            off = _difference(place, self.place)
            self.place = _moved(self.place, off, 1.0 - stays)
            gain = 1.5 * (1.0 - beta) ** 2 * (1.0 + beta) / wait_s
            self.velocity = _moved(self.velocity, off, gain)
            if velocity is not None:
                gain = 1.0 - (0.9 * beta) ** 2
                self.velocity = _moved(self.velocity, _difference(velocity, self.velocity), gain)
        self._heard_s = self._moved_s = now_s

    def move(self, now_s: float) -> None:
        """It continues as it did; after `STALE_S` without a measurement it stands."""
        if self.place is None:
            return
        if now_s - self._heard_s >= STALE_S:
            self.velocity = ZERO
        self.place = _moved(self.place, self.velocity, now_s - self._moved_s)
        self._moved_s = now_s


def _difference(a: Vector, b: Vector) -> Vector:
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def _moved(a: Vector, b: Vector, share: float) -> Vector:
    return a[0] + share * b[0], a[1] + share * b[1], a[2] + share * b[2]


class FollowTarget(CopterMode):
    """Keeps its place relative to the target, with the nose to it; without one it holds.

    Attributes:
        target: where the target is.
    """

    def __init__(self, vehicle: Px4Copter, spec: ModeSpec) -> None:
        super().__init__(vehicle, spec)
        self.target = Target()

    def enter(self) -> None:
        """Brake; the place is at first north of the target."""
        self._course_rad = self._angle_rad = 0.0
        self._turned_s = self.vehicle.now_s
        self._home_down_m = self.vehicle.navigator.home_ned_m()[2]
        self.guide(self.brake_guidance())

    def update(self) -> None:
        """Follow."""
        now_s = self.vehicle.now_s
        self.target.move(now_s)
        if self.target.place is None or self.vehicle.landed:
            return
        turning = self._turn(now_s)
        distance = self._distance_m()
        north, east, _ = place = self.target.place
        away = (math.cos(self._angle_rad), math.sin(self._angle_rad))
        wanted = (north + distance * away[0], east + distance * away[1], self._down_m(place))
        guidance = Guidance(
            motors=Motors.FLY,
            track_position_z=1.0,
            down_m=wanted[2],
            limits=self.vehicle.navigator.direct_limits(),
        )
        motion = self.vehicle.motion
        if abs(motion.down_m - wanted[2]) < CLIMB_FIRST_M:
            v_north, v_east, _ = self.target.velocity
            speed = turning * distance
            velocity = (v_north - away[1] * speed, v_east + away[0] * speed, 0.0)
            guidance = guidance.at(wanted).moving(velocity)
        ahead = (north - motion.north_m, east - motion.east_m)
        if math.hypot(*ahead) > LEAST_TO_LOOK_M:
            guidance = replace(
                guidance, yaw_mode=YawMode.ANGLE, yaw_rad=math.atan2(ahead[1], ahead[0])
            )
        self.drive(guidance)

    def _distance_m(self) -> float:
        return within(self.vehicle.parameters["FLW_TGT_DST"], 1.0, 1e4)

    def _turn(self, now_s: float) -> float:
        """Go round the target to where it is to be seen from; at what rate, rad/s."""
        p, (v_north, v_east, _) = self.vehicle.parameters, self.target.velocity
        if math.hypot(v_north, v_east) >= COURSE_M_S:
            self._course_rad = math.atan2(v_east, v_north)
        angle = self._course_rad + math.radians(within(p["FLW_TGT_FA"], -360.0, 360.0))
        left = math.remainder(angle - self._angle_rad, math.tau)
        wait_s, self._turned_s = now_s - self._turned_s, now_s
        most = within(p["FLW_TGT_MAX_VEL"], 0.0, 20.0) / self._distance_m()
        step = min(max(left, -most * wait_s), most * wait_s)
        self._angle_rad += step
        return step / wait_s if wait_s > 0.0 else 0.0

    def _down_m(self, target: Vector) -> float:
        p, vehicle = self.vehicle.parameters, self.vehicle
        height_m, mode = within(p["FLW_TGT_HT"], 0.0, 1e4), int(p["FLW_TGT_ALT_M"])
        if mode == RELATIVE_TO_TARGET:
            return target[2] - height_m
        if mode == RELATIVE_TO_GROUND:
            return vehicle.motion.down_m + vehicle.height_above_ground_m() - height_m
        return self._home_down_m - height_m
