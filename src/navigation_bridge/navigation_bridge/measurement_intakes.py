"""Measurements taken straight from their frames, with the effects of their messages. No ROS."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from mavlink_vehicle.codec import Intake, mavlink
from mavlink_vehicle.state.position_trust import PositionTrust
from mavlink_vehicle.state.vehicle_state import VehicleState
from mavlink_vehicle.vehicle import Vehicle
from navigation_bridge.engine import Engine
from navigation_bridge.reporting import Front, Reporter
from navigation_bridge.vehicle.map_frame import MapFrame, still_has_pose

__all__ = ["MeasurementIntakes"]

_GLOBAL_POSITION = mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT
_LOCAL_POSITION = mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED


class MeasurementIntakes:
    """Does for a measurement what `Bridge.receive` does for its message."""

    def __init__(
        self,
        vehicle: Vehicle,
        map_frame: MapFrame,
        report: Reporter,
        positions: PositionTrust,
        engine: Engine,
        front: Callable[[], Front],
    ) -> None:
        """Take those of a vehicle; ``front`` returns what publishes the position."""
        self._vehicle = vehicle
        self._map_frame = map_frame
        self._report = report
        self._positions = positions
        self._engine = engine
        self._front = front

    def of(self, system: int, component: int) -> dict[int, Intake]:
        """Return what takes measurements of a sender, by the number of their messages."""
        intakes = self._vehicle.intakes(system, component)
        for number, take in (
            (_GLOBAL_POSITION, self._take_position),
            (_LOCAL_POSITION, self._take_local),
        ):
            if number in intakes:
                intakes[number] = partial(take, intakes[number])
        return intakes

    def learn_frame(self, state: VehicleState) -> None:
        """Learn the map frame from a local position: it may come just after the global one."""
        if state.last_heartbeat_s is None:
            return  # The firmware's projection is not known yet.
        was_known = self._map_frame.frame is not None
        self._map_frame.update(state)
        if self._map_frame.frame is not None and not was_known:
            self._report.position(state)

    def _take_local(self, take: Intake, data: bytes, now: float) -> bool:
        if not take(data, now):
            return False
        if self._map_frame.wants_pairs:
            self.learn_frame(self._vehicle.state)
        return True

    def _take_position(self, take: Intake, data: bytes, now: float) -> bool:
        """Take a position that is nothing but one."""
        live = self._vehicle.live
        before = live.global_position
        if not take(data, now):
            return False
        here = live.global_position
        if self._map_frame.wants_pairs:
            self._map_frame.update(self._vehicle.state)
        if not (self._report.has_position and still_has_pose(live.known, here)):
            self._report.position(self._vehicle.state)
        self._positions.follow(before, live.known, here, now)
        self._engine.position_came(now)
        self._front().update(now)
        return True
