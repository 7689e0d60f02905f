"""OFFBOARD of PX4's planes: a whole position, alone or with a whole velocity, and nothing else."""

from __future__ import annotations

import math

from mavlink_sitl.autopilot.px4.mode import OffboardMode
from mavlink_sitl.autopilot.px4.plane import path_guidance
from mavlink_sitl.autopilot.px4.plane.plane_modes import PlaneMode
from mavlink_sitl.exchange import Vector


def whole(vector: Vector | None) -> bool:
    """Whether all three components are given."""
    return vector is not None and all(math.isfinite(value) for value in vector)


class PlaneOffboard(PlaneMode, OffboardMode):
    """Follows the stream of setpoints.

    * A position is flown to in a straight line, and flown over again and again; far from its
      height it is circled until the height is reached.
    * A position with a velocity is a place on a path and the path's direction there.
    * A velocity, an acceleration, or a position with something missing controls nothing: it
      flies on, level.
    """

    def enter(self) -> None:
        """Follow the latest setpoint."""
        self.level_off()
        self._down_m = self.vehicle.motion.down_m
        self.rising = False
        super().enter()

    def follow(self, fresh: bool) -> None:
        """See `OffboardMode`."""
        self.update()

    def stop(self) -> None:
        """Nobody says anything: fly on, level."""
        self.vehicle.circling = None
        if self.vehicle.landed:
            self.rest()
        else:
            self.fly(None, self.climb_to(self._down_m))

    def update(self) -> None:
        """Follow the setpoint."""
        place, velocity = self.target.position_m, self.target.velocity_m_s
        if not self.vehicle.stream_alive() or place is None or not whole(place):
            self.stop()
            return
        self._down_m = place[2]
        here = self.level()
        if velocity is not None and whole(velocity):
            self.rising = False
            along = path_guidance.unit(velocity[0], velocity[1])
            end = (place[0] + along[0], place[1] + along[1])
            self.follow_path(path_guidance.line(here, place[:2], end), place)
            return
        self.fly_over(path_guidance.point(here, place[:2]), place)
