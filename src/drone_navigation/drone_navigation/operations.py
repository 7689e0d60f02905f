"""What a task or a service wants done, asked of the vehicle. No ROS."""

from __future__ import annotations

from drone_navigation.map_frame import MapFrame
from mavlink_vehicle.vehicle import Vehicle
from navigation_core.tasks.base import OperationKind, Perform


def begin_operation(vehicle: Vehicle, map_frame: MapFrame, intent: Perform, now: float) -> int:
    """Begin an operation; returns its id, which comes back in one ``OperationFinished``.

    Setpoints stop for it, except that a PX4 gives control only to whoever streams already.
    """
    profile = vehicle.profile
    kind = intent.kind
    streams_already = profile is not None and profile.prestream_s > 0.0
    if kind is not OperationKind.TAKE_CONTROL or not streams_already:
        vehicle.close_stream()
    elif not vehicle.stream_open:
        vehicle.open_stream(now)
    if kind is OperationKind.TAKE_OFF:
        assert intent.height_m is not None
        return vehicle.take_off(intent.height_m, now)
    if kind is OperationKind.REPOSITION:
        assert intent.target_enu_m is not None
        return vehicle.reposition(*map_frame.geodetic(intent.target_enu_m), now)
    simple = {
        OperationKind.TAKE_CONTROL: vehicle.take_control,
        OperationKind.ARM: vehicle.arm,
        OperationKind.DISARM: vehicle.disarm,
        OperationKind.HOLD: vehicle.hold,
        OperationKind.LAND: vehicle.land,
        OperationKind.RETURN: vehicle.return_to_launch,
    }
    return simple[kind](now)
