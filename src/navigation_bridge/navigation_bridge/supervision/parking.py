"""Setpoint stream before and after a goal, for autopilots that require one.

A PX4 gives control only to a sender that has streamed setpoints for a while, and treats the end of
the stream as a failure: it would return to launch. So the stream runs before control is taken, and
continues at a goal's end until the vehicle holds by itself. It is not started again, because that
would take control again.
"""

from __future__ import annotations

import math

from mavlink_vehicle.errors import SetpointError
from mavlink_vehicle.events import OperationFinished
from mavlink_vehicle.positions import frames
from mavlink_vehicle.vehicle import SetpointNed, Vehicle
from navigation_bridge.vehicle.traits import velocity_only

# Slow enough to count as standing, but with a direction.
_NEXT_TO_NOTHING_M_S = 0.001


class Parking:
    """Switches the vehicle to its own hold mode while the setpoint stream still runs.

    Attributes:
        operation_id: the pending request to hold, or None.
        deadline_s: time of the next call of :meth:`handle_timer`; None without a setpoint to send.
    """

    def __init__(self, vehicle: Vehicle, period_s: float) -> None:
        """Prepare; nothing is sent before :meth:`begin` or :meth:`keep_streaming`."""
        self._vehicle = vehicle
        self._period_s = period_s
        self._setpoint: SetpointNed | None = None
        self.operation_id: int | None = None
        self.deadline_s: float | None = None

    @property
    def needed(self) -> bool:
        """True if this vehicle treats the end of the stream as a failure."""
        profile = self._vehicle.profile
        return profile is not None and profile.setpoints.prestream_s > 0.0

    def begin(self, setpoint: SetpointNed, now: float) -> bool:
        """Switch the vehicle to its hold mode; False if it does not need that."""
        vehicle = self._vehicle
        if not (self.needed and vehicle.setpoints.is_open and vehicle.in_control_mode):
            return False
        self._setpoint = setpoint
        self.deadline_s = now
        self.operation_id = vehicle.hold(now)
        return True

    def change_over(self, now: float) -> None:
        """Switch the vehicle to its hold mode first, without a stream."""
        self._vehicle.setpoints.close()
        self._setpoint = self.deadline_s = None
        self.operation_id = self._vehicle.hold(now)

    def keep_streaming(self, now: float) -> None:
        """Stream a setpoint that holds, so that the vehicle will give control."""
        if not (self.needed and self._vehicle.setpoints.is_open):
            return
        self._send(hold_setpoint_ned(self._vehicle, None), now)

    def give_up(self) -> None:
        """Release the vehicle; the stream stays as it is."""
        self._setpoint = self.operation_id = self.deadline_s = None

    def finish(self, event: OperationFinished) -> bool:
        """Process the end of an operation; True if it was this one's."""
        if self.operation_id is None or event.operation_id != self.operation_id:
            return False
        self.give_up()
        self._vehicle.setpoints.close()
        return True

    def handle_timer(self, now: float) -> None:
        """Send the setpoint that is due."""
        if self._setpoint is None or self.deadline_s is None or now < self.deadline_s:
            return
        self.deadline_s = max(self.deadline_s + self._period_s, now)
        if not self._vehicle.setpoints.is_open:
            self.give_up()  # the vehicle has left the mode
            return
        self._send(self._setpoint, now)

    def _send(self, setpoint: SetpointNed, now: float) -> None:
        try:
            self._vehicle.send_setpoint(setpoint, now)
        except SetpointError:
            self._setpoint = self.deadline_s = None


def hold_setpoint_ned(vehicle: Vehicle, yaw_enu_rad: float | None) -> SetpointNed:
    """Return the setpoint that stops a vehicle wherever it is: zero velocity.

    A rover or boat gets a tiny velocity along its nose instead. ArduRover and PX4's rovers take the
    direction of a zero velocity as north, and steer there while they brake (observed: turns of 88
    and 100 degrees from 3 m/s).
    """
    velocity, attitude = (0.0, 0.0, 0.0), vehicle.state.attitude
    if velocity_only(vehicle.profile) and attitude is not None:
        yaw = attitude.yaw_ned_rad
        north, east = _NEXT_TO_NOTHING_M_S * math.cos(yaw), _NEXT_TO_NOTHING_M_S * math.sin(yaw)
        velocity = (north, east, 0.0)
    return SetpointNed(
        position_ned_m=None,
        velocity_ned_m_s=velocity,
        acceleration_ned_m_s2=None,
        yaw_ned_rad=None if yaw_enu_rad is None else frames.yaw_enu_to_ned(yaw_enu_rad),
        yaw_rate_rad_s=None,
    )
