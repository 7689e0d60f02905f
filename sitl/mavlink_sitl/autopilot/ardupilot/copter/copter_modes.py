"""The flight modes: each turns its situation into `Guidance`."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from mavlink_sitl.array_ops import Ops
from mavlink_sitl.autopilot.control.controller import sqrt_approach
from mavlink_sitl.autopilot.state.mode import Mode
from mavlink_sitl.exchange import Guidance, Motors, Vector

if TYPE_CHECKING:
    from mavlink_sitl.autopilot.ardupilot.copter.copter import Copter
    from mavlink_sitl.autopilot.common.commander import Commander

BRAKE_DECELERATION_M_S2 = 7.5
"""BRAKE_MODE_DECEL_RATE, 750 cm/s2"""
LAND_PAUSE_S = 4.0
"""From a failsafe's change to LAND until it sinks"""

_SCALAR = Ops()


class Brake(Mode):
    """Stop as fast as possible and stay."""

    def enter(self) -> None:
        """Brake hard."""
        limits = replace(
            self.vehicle.navigator.limits(), acceleration_xy_m_s2=BRAKE_DECELERATION_M_S2
        )
        self.guide(replace(self.hold_guidance(), limits=limits))


class Throw(Mode):
    """Waits to be thrown into the air; nobody throws it here, so it is entered disarmed only."""

    def enter(self) -> None:
        """Wait."""
        self.guide(Guidance(motors=Motors.OFF))

    def ground_motors(self) -> Motors:
        """They start in the air."""
        return Motors.OFF


class Land(Mode):
    """Down: fast above LAND_ALT_LOW, LAND_SPEED below, disarm on the ground.

    Straight down, or to a target that is seen; once that is lost, straight down again.

    Begun without a position it does not control one until it stands, though a position may come
    back (ModeLand::init; recorded in HEARTBEAT.base_mode after a loss of GPS): it sinks level, and
    the wind carries it away.
    """

    vehicle: Copter
    landing = True
    _knew_position = True
    _on_target = False

    @property
    def position_controlled(self) -> bool:
        """See `Mode`."""
        return self._knew_position or self.vehicle.landed

    def enter(self) -> None:
        """Brake and sink."""
        self._knew_position = self.vehicle.estimator.position_ok
        self._speed: float | None = None
        self._sink_from_s = self.vehicle.now_s
        self.update()

    def pause(self) -> None:
        """Stay for a while before sinking: what a failsafe does, for a pilot to step in."""
        self._speed = 0.0
        self._sink_from_s = self.vehicle.now_s + LAND_PAUSE_S
        self.guide(self.hold_guidance())

    def update(self) -> None:
        """Slow down near the ground."""
        if self.vehicle.now_s < self._sink_from_s:
            return
        speed = landing_speed_m_s(self.vehicle)
        target = self.vehicle.landing_target.acquired if self._knew_position else None
        if target is not None:
            self._approach(target, self.vehicle.landing_target.descent_m_s(target, speed))
            return
        if self._speed is not None and abs(speed - self._speed) < 0.02 and not self._on_target:
            return
        first = self._speed is None or self._on_target
        self._on_target = False
        self._speed = speed
        self.guide(
            replace(
                self.hold_guidance(),
                velocity_down_m_s=speed,
                direct_lean=float(not self._knew_position),
                restart_xy=first,
                restart_z=first,
            )
        )

    def _approach(self, target: Vector, speed_m_s: float) -> None:
        """Sink on a target, NED metres."""
        begins = not self._on_target
        self._on_target, self._speed = True, speed_m_s
        self.guide(
            replace(
                self.hold_guidance(),
                track_position_xy=1.0,
                north_m=target[0],
                east_m=target[1],
                velocity_down_m_s=speed_m_s,
                restart_xy=begins,
                restart_z=begins,
            )
        )


def landing_speed_m_s(copter: Commander) -> float:
    """The descent rate at this height above home."""
    parameters = copter.parameters
    final = parameters["LAND_SPEED"] / 100.0
    fast = (parameters["LAND_SPEED_HIGH"] or parameters["WPNAV_SPEED_DN"]) / 100.0
    above = copter.navigator.height_above_home_m() - parameters["LAND_ALT_LOW"] / 100.0
    limit = parameters["WPNAV_ACCEL_Z"] / 100.0
    return min(max(float(sqrt_approach(above, 1.0, limit, _SCALAR)), final), fast)
