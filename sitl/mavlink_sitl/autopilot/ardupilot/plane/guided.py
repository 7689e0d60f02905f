"""GUIDED of ArduPlane: round a point."""

from __future__ import annotations

from mavlink_sitl.autopilot.ardupilot.plane.plane_modes import Loiter
from mavlink_sitl.autopilot.state.setpoint import Setpoint, SetpointFrame
from mavlink_sitl.exchange import ItemReached, Vector


class Guided(Loiter):
    """Round a point: first the one where it was chosen, then that of DO_REPOSITION.

    Of setpoints only the height of SET_POSITION_TARGET_GLOBAL_INT and of an offset in NED is
    taken; everything else has no effect and gets no word.
    """

    def enter(self) -> None:
        """Round this point."""
        self._told = False
        self.slope_from = None
        self.radius_m = 0.0
        super().enter()

    def update(self) -> None:
        """Fly a circle; report it once, when it is reached."""
        super().update()
        if self.on_circle and not self._told:
            self._told = True
            self.vehicle.events.append(ItemReached(0))

    def reposition(self, place: Vector, radius_m: float = 0.0) -> None:
        """Another point."""
        self._told = self.on_circle = False
        self.slope_from = self.vehicle.motion[:3]
        self.radius_m = radius_m
        self.go_round(place)

    def setpoint(self, setpoint: Setpoint) -> None:
        """Set the altitude of a setpoint, if its kind has one that counts."""
        assert self.target is not None
        if setpoint.position_m is None:
            return
        if setpoint.frame is SetpointFrame.OFFSET:
            down = self.vehicle.motion.down_m + setpoint.position_m[2]
        elif setpoint.is_global:
            down = setpoint.position_m[2]
        else:
            return
        self.slope_from = None
        self.go_round((self.target[0], self.target[1], down))

    def climb_to(self, down_m: float) -> float:
        """See `PlaneMode`; along the slope to the point."""
        return super().climb_to(self.sloped_down_m(down_m))

    def change_height(self, down_m: float) -> None:
        """Another height of the circle, NED."""
        assert self.target is not None
        self.slope_from = None
        self.target = (self.target[0], self.target[1], down_m)
