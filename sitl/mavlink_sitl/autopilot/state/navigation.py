"""A vehicle's position on earth, its home, and its speed limits."""

from __future__ import annotations

from mavlink_sitl.autopilot.parameters import Parameters
from mavlink_sitl.exchange import Limits, Motion, Vector
from mavlink_sitl.geodesy import GeoPoint, LocalFrame

LEAST_LIMIT = 0.1
"""The controllers divide by limits, whatever a parameter says"""


class Navigator:
    """Origin, home and limits of one vehicle.

    Attributes:
        home: where RTL goes, or None before the estimator has an origin.
        home_locked: somebody has set it, and arming leaves it there.
    """

    def __init__(self, frame: LocalFrame, parameters: Parameters) -> None:
        self.frame = frame
        self.origin = frame.origin
        self.home: GeoPoint | None = None
        self.home_locked = False
        self._parameters = parameters
        self._known_at = (0.0, 0.0)
        self._down_m = 0.0
        self._here: GeoPoint | None = None
        self._home_ned: tuple[GeoPoint | None, LocalFrame, Vector] = (None, frame, (0.0, 0.0, 0.0))
        """Home and frame, and where that is in it"""
        self.forget_speeds()

    def observe(self, motion: Motion, lost: bool) -> None:
        """Process the position; without one, latitude and longitude stay."""
        self._here = None
        self._down_m = motion.down_m
        if not lost:
            self._known_at = (motion.north_m, motion.east_m)

    def move_origin(self, origin: GeoPoint) -> None:
        """The local frame is there on earth."""
        self.frame = self.frame._replace(origin=origin)
        self.origin, self._here = origin, None

    def here(self) -> GeoPoint:
        """The estimated position of the vehicle."""
        if self._here is None:
            self._here = self.frame.to_geodetic(*self._known_at, self._down_m)
        return self._here

    def set_home(self) -> None:
        """Home is here."""
        self.home = self.here()

    def home_ned_m(self) -> Vector:
        """Home in the local frame; the origin until home is set."""
        home, frame = self.home, self.frame
        if home is not self._home_ned[0] or frame is not self._home_ned[1]:
            local = (0.0, 0.0, 0.0) if home is None else frame.to_local(home)
            self._home_ned = (home, frame, local)
        return self._home_ned[2]

    def height_above_home_m(self) -> float:
        """Height above home."""
        return self.home_ned_m()[2] - self._down_m

    def forget_speeds(self) -> None:
        """The parameters' speeds count again, as after a change of mode."""
        self._speed_xy_m_s: float | None = None
        self._speed_up_m_s: float | None = None
        self._speed_down_m_s: float | None = None

    def forget_speed(self, kind: int) -> None:
        """The parameter's speed of a kind counts again."""
        if kind == 2:
            self._speed_up_m_s = None
        elif kind == 3:
            self._speed_down_m_s = None
        else:
            self._speed_xy_m_s = None

    def change_speed(self, kind: int, speed_m_s: float) -> bool:
        """Another speed until the next change of mode.

        Args:
            kind: SPEED_TYPE: 0 and 1 over ground, 2 climbing, 3 sinking.
            speed_m_s: the speed.

        Returns:
            Whether kind and speed make sense.
        """
        if kind not in (0, 1, 2, 3) or not speed_m_s > 0.0:
            return False
        if kind == 2:
            self._speed_up_m_s = speed_m_s
        elif kind == 3:
            self._speed_down_m_s = speed_m_s
        else:
            self._speed_xy_m_s = speed_m_s
        return True

    def limits(self) -> Limits:
        """Speed, acceleration and jerk, from the parameters and `change_speed`."""

        def limit(name: str, scale: float = 0.01, instead: float | None = None) -> float:
            value = self._parameters[name] * scale if instead is None else instead
            return max(value, LEAST_LIMIT)

        return Limits(
            speed_xy_m_s=limit("WPNAV_SPEED", instead=self._speed_xy_m_s),
            speed_up_m_s=limit("WPNAV_SPEED_UP", instead=self._speed_up_m_s),
            speed_down_m_s=limit("WPNAV_SPEED_DN", instead=self._speed_down_m_s),
            acceleration_xy_m_s2=limit("WPNAV_ACCEL"),
            acceleration_z_m_s2=limit("WPNAV_ACCEL_Z"),
            jerk_xy_m_s3=limit("PSC_JERK_XY", 1.0),
            jerk_z_m_s3=limit("PSC_JERK_Z", 1.0),
        )
