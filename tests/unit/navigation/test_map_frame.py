"""The map frame is the vehicle's own: where it begins, and whose metres it has."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from flight_reports.contents.track import Track, laid_into
from mavlink_vehicle.codec import mavlink
from mavlink_vehicle.positions.frames import Geodetic, LocalFrame, Projection, equidistant_at
from mavlink_vehicle.profiles import ardupilot, px4
from mavlink_vehicle.state.telemetry import GlobalPosition, LocalPosition, Origin
from mavlink_vehicle.state.vehicle_state import VehicleState
from navigation_bridge.vehicle.map_frame import MapFrame
from tests.support.models import ellipsoid

ORIGIN = (60.0, 8.5, 500.0)
FIRMWARES = [
    pytest.param(mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA, ardupilot.PROJECTION, id="ArduPilot"),
    pytest.param(mavlink.MAV_AUTOPILOT_PX4, px4.PROJECTION, id="PX4"),
]


def there(
    frame: LocalFrame,
    north_m: float,
    east_m: float,
    autopilot: int = mavlink.MAV_AUTOPILOT_GENERIC,
    later_s: float = 0.0,
    velocity_ned_m_s: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> VehicleState:
    """A vehicle at a position of its frame; its global position was told so much later."""
    then = [p + later_s * v for p, v in zip((north_m, east_m), velocity_ned_m_s, strict=False)]
    latitude_deg, longitude_deg, altitude_m = frame.geodetic((then[0], then[1], -20.0))
    time_s = 100.0
    return VehicleState(
        autopilot=autopilot,
        vehicle_type=mavlink.MAV_TYPE_QUADROTOR,
        global_position=GlobalPosition(
            time_s + later_s,
            round(1e3 * (time_s + later_s)),
            latitude_deg,
            longitude_deg,
            altitude_m,
            20.0,
            velocity_ned_m_s,
            0.0,
        ),
        local_position=LocalPosition(
            time_s, round(1e3 * time_s), (north_m, east_m, -20.0), velocity_ned_m_s
        ),
    )


def told(place: Geodetic = ORIGIN) -> Origin:
    return Origin(0.0, *place)


def position(frame: MapFrame, state: VehicleState) -> tuple[float, float, float]:
    pose = frame.pose(state)
    assert pose is not None
    return pose.position_enu_m


@pytest.mark.parametrize(("autopilot", "projection"), FIRMWARES)
def test_a_reported_origin_uses_the_projection_of_the_firmware(
    autopilot: int, projection: Projection
) -> None:
    real, frame = LocalFrame(ORIGIN, projection), MapFrame()
    state = replace(there(real, 3000.0, -4000.0, autopilot), origin=told())
    frame.update(state)
    assert position(frame, state) == pytest.approx((-4000.0, 3000.0, 20.0), abs=1e-3)
    place = real.geodetic((50.0, 700.0, -5.0))
    assert frame.enu(place) == pytest.approx((700.0, 50.0, 5.0), abs=1e-3)
    assert frame.geodetic((700.0, 50.0, 5.0)) == pytest.approx(place, abs=1e-9)


@pytest.mark.parametrize("later_s", [-0.1, 0.0, 0.1])
@pytest.mark.parametrize(("autopilot", "projection"), FIRMWARES)
def test_an_origin_from_a_pair_is_where_the_firmware_has_it(
    autopilot: int, projection: Projection, later_s: float
) -> None:
    """5 km away, on the move, and with one of the two positions told a tenth later."""
    real, frame = LocalFrame(ORIGIN, projection), MapFrame()
    state = there(real, 3000.0, -4000.0, autopilot, later_s, (6.0, -8.0, 0.0))
    frame.update(state)
    assert frame.frame is not None
    assert math.dist(frame.frame.ned_m(ORIGIN), (0.0, 0.0, 0.0)) < 0.01
    other = there(real, -3000.0, 100.0, autopilot)
    frame.update(other)
    assert position(frame, other) == pytest.approx((100.0, -3000.0, 20.0), abs=0.01)


def test_positions_that_are_too_far_apart_in_time_are_no_pair() -> None:
    real, frame = LocalFrame(ORIGIN, px4.PROJECTION), MapFrame()
    frame.update(there(real, 10.0, 10.0, mavlink.MAV_AUTOPILOT_PX4, 0.2))
    assert frame.frame is None


@pytest.mark.parametrize(("autopilot", "projection"), FIRMWARES)
def test_a_firmware_identified_late_is_used_from_then_on(
    autopilot: int, projection: Projection
) -> None:
    real, frame = LocalFrame(ORIGIN, projection), MapFrame()
    frame.update(there(real, 0.0, 0.0))
    early = frame.frame
    state = there(real, 1000.0, 1000.0, autopilot)
    frame.update(state)
    assert frame.frame != early
    assert position(frame, state) == pytest.approx((1000.0, 1000.0, 20.0), abs=0.01)


@pytest.mark.parametrize("origin_told", [True, False])
@pytest.mark.parametrize(
    "projection", [ardupilot.PROJECTION, px4.PROJECTION, equidistant_at(ORIGIN[0])]
)
def test_for_an_unknown_firmware_the_scale_is_measured(
    projection: Projection, origin_told: bool
) -> None:
    real, frame = LocalFrame(ORIGIN, projection), MapFrame()
    for way_m in range(0, 420, 20):
        state = there(real, float(way_m), 0.5 * way_m)
        frame.update(replace(state, origin=told()) if origin_told else state)
    place = real.geodetic((400.0, 200.0, 0.0))
    assert frame.enu(place) == pytest.approx((200.0, 400.0, 0.0), abs=0.05)


def test_a_restart_resets_the_origin() -> None:
    frame = MapFrame()
    frame.update(replace(VehicleState(), origin=told()))
    assert frame.origin == ORIGIN
    frame.update(replace(VehicleState(), boot_count=1))
    assert frame.frame is None
    assert frame.pose(there(LocalFrame(ORIGIN, px4.PROJECTION), 0.0, 0.0)) is None


def test_two_tracks_are_aligned_by_position_on_earth_not_by_map_metres() -> None:
    """A PX4 and an ArduPilot, half a kilometre apart, that stood at the same place."""
    north, east = 2500.0, 1500.0
    place = ellipsoid.on_ground(north, east, ORIGIN)
    first = LocalFrame(ORIGIN, ardupilot.PROJECTION)
    second = LocalFrame((ORIGIN[0] + 0.004, ORIGIN[1], 450.0), px4.PROJECTION)
    north_m, east_m, down_m = second.ned_m(place)
    position = np.array([[east_m, north_m, -down_m]])
    track = Track(np.zeros(1), position, np.zeros((1, 3)), np.zeros(1), "home", second)
    moved = laid_into(track, first)
    assert moved.frame == first
    wanted_north_m, wanted_east_m, wanted_down_m = first.ned_m(place)
    assert moved.position_enu_m[0] == pytest.approx(
        (wanted_east_m, wanted_north_m, -wanted_down_m), abs=1e-3
    )
