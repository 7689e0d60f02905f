"""The modes of ArduRover, for cars and for boats. Observed in `rover_guided`."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

from mavlink_sitl.autopilot.ardupilot.rover.moving_reference import (
    CORNER_M_S,
    LegReference,
    Point,
    SetpointReference,
    drive_towards,
)
from mavlink_sitl.autopilot.safety.rally import return_point_ned_m
from mavlink_sitl.autopilot.state.mode import Mode
from mavlink_sitl.autopilot.state.setpoint import DriveTarget, Setpoint, SetpointFrame
from mavlink_sitl.exchange import ItemReached, Motors, Severity, YawMode
from mavlink_sitl.guidance import DriveGuidance

if TYPE_CHECKING:
    from mavlink_sitl.autopilot.ardupilot.rover.rover import Rover

TARGET_TIMEOUT_S = 3.0
STOPPING = "target not received last 3secs, stopping"
REFUSED = "Ignoring SET_POSITION_TARGET_LOCAL_NED; set ACC_IGNORE in mask"


class DriveMode(Mode):
    """A mode of one rover or boat."""

    vehicle: Rover
    route: LegReference | None = None

    def ground_motors(self) -> Motors:
        """A rover never counts as landed."""
        return Motors.FLY

    def stop(self) -> None:
        """Brake."""
        self.drive(DriveGuidance(motors=Motors.FLY, limits=self.vehicle.navigator.limits()))

    def stay_at(self, point: Point) -> None:
        """Keep near a point: drift inside LOIT_RADIUS, drive back from outside."""
        rover, m = self.vehicle, self.vehicle.motion
        north, east = point[0] - m.north_m, point[1] - m.east_m
        away = math.hypot(north, east) - max(rover.parameters["LOIT_RADIUS"], 0.2)
        if away <= 0.0:
            self.stop()
            return
        course = math.atan2(east, north)
        speed = min(0.5 * away + 0.2, rover.navigator.cruise_m_s())
        if abs(math.remainder(course - m.yaw_rad, math.tau)) > 2.1 and away < 5.0:
            course, speed = course + math.pi, -speed
        self.drive(drive_towards(rover, point, speed, course))


class Hold(DriveMode):
    """Throttle closed, wheels straight: it rolls out (4 s from 2 m/s)."""

    def enter(self) -> None:
        """Let it roll."""
        self.drive(DriveGuidance(motors=Motors.IDLE))


class Loiter(DriveMode):
    """Stay at where it can stop; a boat drives back when it has drifted away."""

    def enter(self) -> None:
        """Choose the place."""
        self._place = self.vehicle.stopping_point()
        self.stop()

    def update(self) -> None:
        """Go back if need be."""
        self.stay_at(self._place)


class Circle(DriveMode):
    """Round a point CIRC_RADIUS in front of the nose, clockwise."""

    def enter(self) -> None:
        """Choose the centre."""
        m = self.vehicle.motion
        p = self.vehicle.parameters
        self._radius = max(p["CIRC_RADIUS"], p["TURN_RADIUS"], 1.0)
        self._centre = (
            m.north_m + self._radius * math.cos(m.yaw_rad),
            m.east_m + self._radius * math.sin(m.yaw_rad),
        )
        self.update()

    def update(self) -> None:
        """Follow the circle: along its tangent, and back to it."""
        rover, m = self.vehicle, self.vehicle.motion
        north, east = m.north_m - self._centre[0], m.east_m - self._centre[1]
        distance = math.hypot(north, east)
        tangent = math.atan2(east, north) + math.pi / 2
        outside = (distance - self._radius) / self._radius
        course = tangent + math.atan(3.0 * outside)
        speed = rover.parameters["CIRC_SPEED"] or rover.navigator.cruise_m_s()
        self.drive(drive_towards(rover, self._centre, speed, course))


class Guided(DriveMode):
    """Setpoints.

    * A position is driven to, also one that came while disarmed, on arming; the arrival is
      reported as MISSION_ITEM_REACHED of item 0.
    * Velocities, rates and headings run out after three seconds, with words.
    * An acceleration that is not ignored makes the whole setpoint be rejected, with words.
    * A velocity alone is a course and a speed, so backwards means turning round; with a rate
      of turn, a backward velocity in the body's frame is driven backwards; with a heading the
      direction of the velocity does not count.
    * A velocity of zero has the heading of its arctangent: the wheels steer North, or in the
      body's frame straight on, while it rolls out (GCS_MAVLink_Rover.cpp).
    * No velocity is faster than WP_SPEED.
    """

    def enter(self) -> None:
        """Stop; no old setpoint is followed again."""
        self.vehicle.backwards = False
        self.route = None
        self._expires_s = math.inf
        self._reported = False
        self._target = DriveGuidance(motors=Motors.FLY, limits=self.vehicle.navigator.limits())
        self.drive(self._target)

    def setpoint(self, setpoint: Setpoint) -> None:
        """Set a new target; everything in it is finite."""
        rover = self.vehicle
        if setpoint.acceleration_m_s2 is not None:
            rover.say(Severity.INFO, REFUSED)
        elif (place := setpoint.place_ned_m(rover.motion)) is not None:
            self.go_to(place[:2])
        else:
            target = self._moving(setpoint)
            if target is not None:
                self.route = None
                self._expires_s = rover.now_s + TARGET_TIMEOUT_S
                self._target = target
                self.drive(target)

    def go_to(self, place: Point) -> None:
        """Drive to a place; from the way to another one on to it."""
        rover, route = self.vehicle, self.route
        if isinstance(route, SetpointReference) and not route.reached:
            route.redirect(place)
        else:
            self.route = SetpointReference(rover, place, rover.navigator.cruise_m_s())
        self._expires_s = math.inf
        self._reported = False

    def go(self, target: DriveTarget) -> None:
        """Drive at a share of WP_SPEED with a heading, or turning; runs out as a velocity does."""
        rover = self.vehicle
        speed = min(max(target.thrust, -1.0), 1.0) * rover.navigator.cruise_m_s()
        by_heading = target.heading_rad is not None
        self.route = None
        self._expires_s = rover.now_s + TARGET_TIMEOUT_S
        self._target = DriveGuidance(
            motors=Motors.FLY,
            speed_m_s=speed,
            yaw_mode=YawMode.ANGLE if by_heading else YawMode.RATE,
            yaw_rad=target.heading_rad or 0.0,
            yaw_rate_rad_s=target.turn_rate_rad_s,
            turn_rate_limit_rad_s=rover.turn_limit_rad_s(speed),
            limits=rover.navigator.limits(),
        )
        self.drive(self._target)

    def _moving(self, setpoint: Setpoint) -> DriveGuidance | None:
        """The target of a setpoint without a position; None for one that says nothing."""
        yaw = self.vehicle.motion.yaw_rad
        body = setpoint.frame is SetpointFrame.BODY
        base = DriveGuidance(motors=Motors.FLY, limits=self.vehicle.navigator.limits())
        velocity = setpoint.velocity_m_s
        speed = 0.0
        if velocity is not None:
            speed = min(math.hypot(velocity[0], velocity[1]), self.vehicle.navigator.cruise_m_s())
            base = replace(base, turn_rate_limit_rad_s=self.vehicle.turn_limit_rad_s(speed))
        if setpoint.yaw_rate_rad_s is not None and setpoint.yaw_rad is None:
            backwards = velocity is not None and body and velocity[0] < 0.0
            return replace(
                base,
                speed_m_s=-speed if backwards else speed,
                yaw_mode=YawMode.RATE,
                yaw_rate_rad_s=setpoint.yaw_rate_rad_s,
            )
        if setpoint.yaw_rad is not None:
            heading = setpoint.yaw_rad + (yaw if body else 0.0)
        elif velocity is not None:
            heading = math.atan2(velocity[1], velocity[0]) + (yaw if body else 0.0)
        else:
            return None
        return replace(base, speed_m_s=speed, yaw_mode=YawMode.ANGLE, yaw_rad=heading)

    def update(self) -> None:
        """Follow the way; let old targets run out."""
        rover = self.vehicle
        if rover.now_s >= self._expires_s:
            self._expires_s = math.inf
            rover.say(Severity.WARNING, STOPPING)
            self.stop()
        if self.route is None or not rover.armed:
            return
        if not self.route.reached:
            self.drive(self.route.follow())
            return
        if not self._reported:
            self._reported = True
            rover.events.append(ItemReached(0))
        rover.rest_at(self, self.route.destination)


class ReturnToLaunch(DriveMode):
    """Back home or to a rally point; it says when it is there, and stays in RTL, armed.

    Recorded in `rover_guided`.
    """

    def enter(self) -> None:
        """Set off."""
        self.route = LegReference(
            self.vehicle, return_point_ned_m(self.vehicle)[:2], self.speed_m_s()
        )
        self._said = False

    def speed_m_s(self) -> float:
        """The speed of the return."""
        return self.vehicle.parameters["RTL_SPEED"] or self.vehicle.navigator.cruise_m_s()

    def update(self) -> None:
        """Run one step."""
        if self.route is None or not self.vehicle.armed:
            return
        if not self.route.reached or self.goes_on():
            self.drive(self.route.follow())
            return
        if not self._said:
            self._said = True
            self.vehicle.say(Severity.INFO, "Reached destination")
        self.vehicle.rest_at(self, self.route.destination)

    def goes_on(self) -> bool:
        """Whether another leg begins where this one ended."""
        return False


class SmartReturn(ReturnToLaunch):
    """SMART_RTL: back the way it came, without the loops of it."""

    def enter(self) -> None:
        """Brake, and find the corners of the way."""
        self._said = False
        crumbs = self.vehicle.trail.crumbs
        self._points = crumbs.shortest() if crumbs is not None else []
        self._next_leg(self.vehicle.stopping_point(), 0.0)

    def _next_leg(self, start: Point, speed_m_s: float) -> None:
        """To the next corner."""
        rover = self.vehicle
        destination = start
        if self._points:
            north, east = self._points.pop()
            destination = (north, east)
        leaving = min(CORNER_M_S, self.speed_m_s()) if self._points else 0.0
        self.route = LegReference(rover, destination, self.speed_m_s(), start, speed_m_s, leaving)

    def goes_on(self) -> bool:
        """Round the corner, while there are any."""
        if not self._points or self.route is None:
            return False
        self._next_leg(self.route.destination, self.vehicle.motion.speed_m_s)
        return True
