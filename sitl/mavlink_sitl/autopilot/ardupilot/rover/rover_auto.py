"""AUTO of rovers and boats: drives the mission. Seen in the recording `rover_auto`.

Waypoints are driven through at the speed of a corner;
at the last one, and at those with a delay, the vehicle stands.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from mavlink_sitl.autopilot.ardupilot.rover.moving_reference import CORNER_M_S, LegReference
from mavlink_sitl.autopilot.ardupilot.rover.rover_modes import DriveMode, Guided
from mavlink_sitl.autopilot.common.auto import Auto
from mavlink_sitl.autopilot.common.auto_tasks import AutoTask, Delay
from mavlink_sitl.autopilot.common.guided_item import Bounds, Obey
from mavlink_sitl.autopilot.plans.plan_commands import MOVING
from mavlink_sitl.autopilot.plans.plans import Cmd, PlanItem
from mavlink_sitl.exchange import Guidance, Motors, Severity, Vector, YawMode
from mavlink_sitl.guidance import DriveGuidance

if TYPE_CHECKING:
    from mavlink_sitl.autopilot.ardupilot.rover.rover import Rover

HEADING_REACHED = math.radians(5.0)
START_S = 0.9
"""From arming until a mission moves"""


class DriveTo(AutoTask):
    """The way to an item's place.

    Args:
        target: its place, NED metres.
        last: whether nothing comes after it.
        speed_m_s: how fast it drives already.
    """

    auto: DriveAuto
    vehicle: Rover

    def __init__(
        self, auto: DriveAuto, item: PlanItem, target: Vector, last: bool, speed_m_s: float
    ) -> None:
        super().__init__(auto, item)
        self._target = target
        waits = item.command in (Cmd.WAYPOINT, Cmd.LOITER_TIME)
        self._wait_s = max(item.params[0], 0.0) if waits else 0.0
        self._stops = last or self._wait_s > 0.0
        self._endless = item.command == Cmd.LOITER_UNLIM
        self._there_since_s: float | None = None
        self.begin(speed_m_s)

    def begin(self, speed_m_s: float) -> None:
        """Set off from where the vehicle is."""
        rover = self.vehicle
        here = (rover.motion.north_m, rover.motion.east_m) if speed_m_s > 0.0 else None
        leaving = 0.0 if self._stops else min(CORNER_M_S, rover.cruise_m_s())
        self.route = LegReference(
            rover, self._target[:2], rover.cruise_m_s(), here, speed_m_s, leaving
        )
        self.auto.route = self.route

    def update(self) -> None:
        """Drive on, or stay."""
        if not self.route.reached:
            self.auto.drive(self.route.follow())
        else:
            self.vehicle.rest_at(self.auto, self.route.destination)

    def finished(self) -> bool:
        """Whether it is there, and has waited."""
        if not self.route.reached or self._endless:
            return False
        if self._there_since_s is None:
            self._there_since_s = self.vehicle.now_s
        return self.vehicle.now_s - self._there_since_s >= self._wait_s


class TurnTo(AutoTask):
    """NAV_SET_YAW_SPEED: drive with a speed until the nose points where it says."""

    auto: DriveAuto
    vehicle: Rover

    def __init__(self, auto: DriveAuto, item: PlanItem) -> None:
        super().__init__(auto, item)
        angle_deg, speed_m_s, relative, _ = item.params
        yaw, most = self.vehicle.motion.yaw_rad, self.vehicle.cruise_m_s()
        self._heading = math.radians(angle_deg) + (yaw if relative > 0.0 else 0.0)
        self._speed_m_s = min(max(speed_m_s, -most), most)
        self.auto.route = None

    def _off(self) -> float:
        return abs(math.remainder(self._heading - self.vehicle.motion.yaw_rad, math.tau))

    def update(self) -> None:
        """Turn while driving; then stop."""
        if self._off() < HEADING_REACHED:
            self.auto.stop()
            return
        rover = self.vehicle
        self.auto.drive(
            DriveGuidance(
                motors=Motors.FLY,
                speed_m_s=self._speed_m_s,
                yaw_mode=YawMode.ANGLE,
                yaw_rad=self._heading,
                turn_rate_limit_rad_s=rover.turn_limit_rad_s(self._speed_m_s),
                limits=rover.navigator.limits(),
            )
        )

    def finished(self) -> bool:
        """Within five degrees."""
        return self._off() < HEADING_REACHED


class DriveAuto(DriveMode, Auto):
    """Drives the uploaded mission."""

    vehicle: Rover

    moving = MOVING - {Cmd.SPLINE, Cmd.LOITER_TO_ALT} | {Cmd.SET_YAW_SPEED, Cmd.GUIDED_ENABLE}

    def hold_guidance(self) -> Guidance:
        """Brake."""
        return DriveGuidance(motors=Motors.FLY, limits=self.vehicle.navigator.limits())

    def enter(self) -> None:
        """Resume the mission where it was left, or begin it."""
        self.route = None
        self.vehicle.backwards = False
        self._bounds = Bounds()
        super().enter()

    def update(self) -> None:
        """Run one step once armed."""
        if self.vehicle.armed and self.vehicle.now_s - self.vehicle.arming.armed_at_s >= START_S:
            Auto.update(self)

    def limits_changed(self) -> None:
        """Another speed: continue with it."""
        if isinstance(self.task, DriveTo):
            self.task.route.change_speed(self.vehicle.cruise_m_s())

    def _do(self, item: PlanItem, begins: bool) -> bool:
        """DO_SET_REVERSE, besides what every vehicle does."""
        if item.command == Cmd.SET_REVERSE:
            self.vehicle.backwards = item.params[0] == 1.0
        elif item.command == Cmd.GUIDED_LIMITS:
            time_s, _, _, distance_m = (max(value, 0.0) for value in item.params)
            self._bounds = Bounds(time_s, most_distance_m=distance_m)
        return super()._do(item, begins)

    @property
    def guided(self) -> Guided | None:
        """GUIDED, while an item has the vehicle obey a companion."""
        task = self.task
        return task.guided if isinstance(task, Obey) and task.begins else None

    def _speed(self) -> float:
        m = self.vehicle.motion
        return m.speed_m_s

    def _say_reached(self, place: int, item: PlanItem) -> None:
        if item.command in (Cmd.WAYPOINT, Cmd.LOITER_TIME):
            self.vehicle.say(Severity.INFO, f"Reached waypoint #{place}")

    def _complete(self) -> None:
        super()._complete()
        self.route = None
        self.vehicle.say(Severity.NOTICE, "Mission Complete")

    def _begin(self, item: PlanItem) -> None:
        m, rover = self.vehicle.motion, self.vehicle
        on_the_way = isinstance(self.task, DriveTo)
        if item.command == Cmd.DELAY:
            self.task = Delay(self, item)
            return
        if item.command == Cmd.SET_YAW_SPEED:
            self.task = TurnTo(self, item)
            return
        if item.command == Cmd.GUIDED_ENABLE:
            self.route = None
            self.task = Obey(self, item, rover.guided, self._bounds)
            return
        here = (m.north_m, m.east_m, m.down_m)
        target = here
        if item.command == Cmd.RTL:
            target = rover.navigator.home_ned_m()
        elif item.command not in (Cmd.TAKEOFF, Cmd.LAND):
            target = self.place_of(item, here)
        plans = rover.plans
        following = self._walk(plans.current + 1, dict(plans.jumps))
        last = not any(i.command in self.moving for _, i in following)
        self.task = DriveTo(self, item, target, last, self._speed() if on_the_way else 0.0)
