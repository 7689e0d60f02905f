"""What a task or a service wants done, asked of the vehicle. No ROS."""

from __future__ import annotations

from mavlink_vehicle.vehicle import Vehicle
from navigation_core.tasks.base import OperationKind, Perform


def begin_operation(vehicle: Vehicle, intent: Perform, now: float) -> int:
    """Begin an operation; returns its id, which comes back in one ``OperationFinished``.

    Setpoints stop for it, except that a PX4 gives control only to whoever streams already.
    """
    profile = vehicle.profile
    kind = intent.kind
    streams_already = profile is not None and profile.setpoints_outside_control_mode
    if kind is not OperationKind.TAKE_CONTROL or not streams_already:
        vehicle.close_stream()
    if kind is OperationKind.ARM:
        return vehicle.arm(now)
    if kind is OperationKind.DISARM:
        return vehicle.disarm(now)
    if kind is OperationKind.TAKE_OFF:
        assert intent.height_m is not None
        return vehicle.take_off(intent.height_m, now)
    modes = (
        {}
        if profile is None
        else {
            OperationKind.TAKE_CONTROL: profile.control_mode,
            OperationKind.HOLD: profile.hold_mode,
            OperationKind.LAND: profile.land_mode,
            OperationKind.RETURN: profile.return_mode,
        }
    )
    return vehicle.change_mode(modes.get(kind) or "", now)
