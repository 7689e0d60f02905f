"""A ground station or companion computer for the simulated PX4."""

from __future__ import annotations

import copy
import math
import struct

from pymavlink.dialects.v20 import all as mav

from mavlink_sitl import Simulation, VehicleConfig, Wind, World
from mavlink_sitl.autopilot.personality import px4
from mavlink_sitl.config import DEFAULT_HOME
from mavlink_sitl.geodesy import PX4, GeoPoint
from sitl_support.ground_station import GroundStation, Message

HOME = GeoPoint(47.397743, 8.545594, 488.0)
NAN = math.nan
FAST_STREAMS = (24, 30, 31, 32, 33, 36, 74, 83, 85, 87, 105, 111, 132, 141, 331)

VERDICT_S = 0.02
"""OFFBOARD without a stream is judged up to 10 ms later"""


class Px4Station(GroundStation):
    """Sends and receives on the first link; DO_SET_MODE gives the second verdict."""

    def command_results(self, command: int, *params: float, component: int = 1) -> list[int]:
        """COMMAND_LONG; the results of all its acknowledgements."""
        values = [*params, *([0.0] * (7 - len(params)))]
        answers = self.send(mav.MAVLink_command_long_message(1, component, command, 0, *values))
        results = [m.result for m in answers if m.get_type() == "COMMAND_ACK"]
        if command == mav.MAV_CMD_DO_SET_MODE and len(results) == 1:
            begin = len(self.log)
            self.run(VERDICT_S)
            later = [m for _, m in self.log[begin:] if m.get_type() == "COMMAND_ACK"]
            results += [m.result for m in later]
        return results

    def mode(self, number: int) -> int:
        results = self.command_results(
            mav.MAV_CMD_DO_SET_MODE, 1, number >> 16 & 0xFF, number >> 24 & 0xFF
        )
        assert results[0] == 0
        assert len(results) == 2
        return results[1]

    def go_to(
        self, north: float, east: float, down: float, mask: int = 0x9F8, frame: int = 1
    ) -> list[Message]:
        return self.setpoint(mask, (north, east, down), frame=frame)

    def stream_to(self, seconds: float, north: float, east: float, down: float) -> None:
        self.stream(seconds, 20.0, lambda: self.go_to(north, east, down))

    def returns_without_setpoints(self) -> None:
        """See the failsafe a second after the last setpoint in OFFBOARD, and the return."""
        took_s = self.run_until(lambda: self.custom_mode == px4.RTL)
        assert abs(took_s - 1.0) <= 0.15
        assert "Failsafe activated\t" in self.texts()
        self.run(2.1)
        beat, mode = self.last("HEARTBEAT"), self.last("CURRENT_MODE")
        assert (beat.custom_mode, beat.base_mode, beat.system_status) == (px4.RTL, 157, 5)
        assert (mode.custom_mode, mode.intended_custom_mode) == (px4.RTL, px4.OFFBOARD)

    def quiet(self, interval_us: float = -1.0) -> Px4Station:
        """Fast streams off: what moves is looked at in the truth, and tests get faster."""
        for message_id in FAST_STREAMS:
            assert self.command(mav.MAV_CMD_SET_MESSAGE_INTERVAL, message_id, interval_us) == 0
        return self

    def talkative(self) -> Px4Station:
        """Fast streams as they are by default."""
        return self.quiet(0.0)

    def gcs_heartbeat(self) -> None:
        self.send(mav.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))

    @property
    def custom_mode(self) -> int:
        return self.vehicle.firmware.mode.spec.number

    @property
    def armed(self) -> bool:
        return self.vehicle.firmware.armed

    def take_off(self, height_m: float = 10.0) -> Px4Station:
        """OFFBOARD, arm, climb; five setpoints a second are enough for it."""

        def climb() -> None:
            self.go_to(0.0, 0.0, -height_m)

        self.stream(1.0, 5.0, climb)
        assert self.mode(px4.OFFBOARD) == 0
        assert self.arm() == 0
        self.stream(13.0, 5.0, climb)
        assert abs(self.position[2] + height_m) < 0.6
        return self

    def parameter(self, name: str) -> float | int:
        answers = self.send(mav.MAVLink_param_request_read_message(1, 1, name.encode(), -1))
        (value,) = (m for m in answers if m.get_type() == "PARAM_VALUE")
        return bytewise(value.param_value) if value.param_type == 6 else float(value.param_value)

    def set_parameter(self, name: str, value: float, kind: int = 9) -> list[Message]:
        if kind == 6:
            value = struct.unpack("<f", struct.pack("<i", int(value)))[0]
        answers = self.send(mav.MAVLink_param_set_message(1, 1, name.encode(), value, kind))
        return [m for m in answers if m.get_type() == "PARAM_VALUE"]


def at(north_m: float, east_m: float) -> tuple[int, int]:
    """A place near home as 1e7 degrees."""
    latitude_deg, longitude_deg = PX4.to_geodetic(HOME, north_m, east_m)
    return round(latitude_deg * 1e7), round(longitude_deg * 1e7)


def plan_item(
    command: int, north_m: float, east_m: float, up_m: float = 0.0, *params: float
) -> Message:
    """MISSION_ITEM_INT relative to home."""
    values = [*params, *([0.0] * (4 - len(params)))]
    return mav.MAVLink_mission_item_int_message(
        1, 1, 0, 6, command, 0, 1, *values, *at(north_m, east_m), up_m, 0
    )


def bytewise(value: float) -> int:
    """The integer with the float's four bytes."""
    return int(struct.unpack("<i", struct.pack("<f", value))[0])


def px4_copter(
    links: tuple[str, ...] = ("onboard",),
    parameters: dict[str, float] | None = None,
    vehicle: str = "copter",
    wind_ned_m_s: tuple[float, float, float] = (0.0, 0.0, 0.0),
    firmware: str = "",
) -> Px4Station:
    """A PX4 that has just been switched on; a copter by default."""
    config = VehicleConfig(
        vehicle=vehicle,
        autopilot="px4",
        firmware=firmware,
        home=HOME,
        heading_deg=0.0,
        ready_after_s=1.0,
        links=links,
        parameters=parameters or {},
    )
    simulation = Simulation([config], seed=1, world=World(wind=Wind(wind_ned_m_s)))
    return Px4Station(simulation, system=1, component=191)


def ready_px4(
    links: tuple[str, ...] = ("onboard",),
    parameters: dict[str, float] | None = None,
    vehicle: str = "copter",
    wind_ned_m_s: tuple[float, float, float] = (0.0, 0.0, 0.0),
    firmware: str = "",
) -> Px4Station:
    """A PX4 that may be armed."""
    station = px4_copter(links, parameters, vehicle, wind_ned_m_s, firmware)
    station.run_until(lambda: station.vehicle.firmware.estimator.position_ok)
    station.run(1.0)
    return station


def flying_px4(
    height_m: float = 10.0, parameters: dict[str, float] | None = None, firmware: str = ""
) -> Px4Station:
    """A PX4 that follows setpoints in the air above home; the fast streams come from there on."""
    station = ready_px4(parameters=parameters, firmware=firmware).quiet()
    station.take_off(height_m).talkative()
    station.stream_to(0.3, 0.0, 0.0, -height_m)
    return station


def near_home(items: list[Message]) -> list[Message]:
    """Items of `missions.py`, which are near another home, at the same offsets here."""
    wider = math.cos(math.radians(DEFAULT_HOME.latitude_deg)) / math.cos(
        math.radians(HOME.latitude_deg)
    )
    moved = [copy.copy(item) for item in items]
    for item in moved:
        if item.x or item.y:
            item.x += round(HOME.latitude_deg * 1e7) - round(DEFAULT_HOME.latitude_deg * 1e7)
            east = item.y - round(DEFAULT_HOME.longitude_deg * 1e7)
            item.y = round(HOME.longitude_deg * 1e7) + round(east * wider)
    return moved
