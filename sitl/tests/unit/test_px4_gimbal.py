"""The gimbal of a simulated PX4, as recorded of PX4 1.17 with its gimbal module."""

from __future__ import annotations

import math

import pytest
from pymavlink.dialects.v20 import all as mav

from mavlink_sitl import Simulation, VehicleConfig
from sitl_support.ground_station import ACCEPTED
from sitl_support.px4_station import HOME, Px4Station, at, ready_px4

NAN = math.nan
DENIED = 2
CONFIGURE, PITCHYAW = (
    mav.MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE,
    mav.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW,
)
MOUNT, ROI, NO_ROI = (
    mav.MAV_CMD_DO_MOUNT_CONTROL,
    mav.MAV_CMD_DO_SET_ROI_LOCATION,
    mav.MAV_CMD_DO_SET_ROI_NONE,
)
ME = (1, 191)


def station_of(**parameters: float) -> Px4Station:
    return ready_px4(parameters={"MNT_MODE_IN": 4.0, **parameters}).quiet()


@pytest.fixture
def station() -> Px4Station:
    return station_of()


def in_control(station: Px4Station) -> Px4Station:
    assert station.command(CONFIGURE, *ME, -1, -1) == ACCEPTED
    return station


def requested(station: Px4Station, message_id: int) -> mav.MAVLink_message:
    name = mav.mavlink_map[message_id].msgname
    assert station.command(mav.MAV_CMD_REQUEST_MESSAGE, message_id) == ACCEPTED
    return station.last(name)


def status(station: Px4Station) -> mav.MAVLink_message:
    return requested(station, 285)


def angles_deg(station: Px4Station) -> tuple[float, float, float]:
    """Roll, pitch and yaw as it reports them."""
    station.run(0.3)
    w, x, y, z = status(station).q
    return (
        math.degrees(math.atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))),
        math.degrees(math.asin(2.0 * (w * y - z * x))),
        math.degrees(math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))),
    )


def near(*angles: float) -> tuple[float, float, float]:
    return pytest.approx(angles, abs=0.05)  # type: ignore[return-value]


def test_without_the_module_nobody_answers_and_nothing_is_reported() -> None:
    for station in (ready_px4().quiet(), station_of(MNT_MODE_OUT=2.0), station_of(MNT_MODE_IN=1.0)):
        for command in (CONFIGURE, PITCHYAW, MOUNT):
            assert station.command_results(command, 1, 191, -1, -1) == []
        for message_id in (265, 280, 281, 285):
            assert station.command(mav.MAV_CMD_REQUEST_MESSAGE, message_id) == DENIED
        assert station.command(NO_ROI) == ACCEPTED


def test_it_reports_itself_and_who_is_in_control(station: Px4Station) -> None:
    information = requested(station, 280)
    assert (information.cap_flags, information.gimbal_device_id) == (132530, 1)
    assert (information.pitch_min, information.yaw_max) == (-90.0, 360.0), "degrees, as observed"
    assert station.command(mav.MAV_CMD_REQUEST_MESSAGE, 283) == DENIED, "there is no other device"
    begin = len(station.log)
    station.run(4.0)
    names = [message.get_type() for _, message in station.log[begin:]]
    assert names.count("GIMBAL_MANAGER_STATUS") == 2
    assert names.count("GIMBAL_DEVICE_ATTITUDE_STATUS") == 4
    assert names.count("MOUNT_ORIENTATION") == 40
    assert status(station).flags == 12
    assert status(station).gimbal_device_id == 1


@pytest.mark.parametrize(
    ("before", "asked", "after"),
    [
        ((0, 0), (255, 190), (255, 190)),
        ((255, 190), (-1, -1), (255, 190)),
        ((255, 190), (-2, -2), (1, 1)),
        ((255, 190), (-3, -3), (255, 190)),
        (ME, (-3, -3), (0, 0)),
        (ME, (NAN, NAN), ME),
    ],
)
def test_control_is_taken_and_released(
    station: Px4Station,
    before: tuple[int, int],
    asked: tuple[float, float],
    after: tuple[int, int],
) -> None:
    station.command(CONFIGURE, *before, -1, -1)
    assert station.command(CONFIGURE, *asked, -1, -1) == ACCEPTED
    report = requested(station, 281)
    assert (report.primary_control_sysid, report.primary_control_compid) == after


def test_only_the_one_in_control_points_it(station: Px4Station) -> None:
    assert station.command(PITCHYAW, -30, 20, NAN, NAN, 12) == DENIED
    assert angles_deg(station) == near(0, 0, 0)
    in_control(station)
    assert station.command(PITCHYAW, -30, 20, NAN, NAN, 12) == ACCEPTED
    assert angles_deg(station) == near(0, -30, 20)
    station.command(CONFIGURE, 255, 190, -1, -1)
    assert station.command(PITCHYAW, 10, 0, NAN, NAN, 12) == DENIED
    assert angles_deg(station) == near(0, -30, 20)
    # A command of the older protocol needs no control.
    assert station.command(MOUNT, -20, 0, 10, 0, 0, 0, 2) == ACCEPTED
    assert angles_deg(station) == near(0, -20, 10)


@pytest.mark.parametrize(
    ("params", "flags", "expected"),
    [
        ((-30, 45, NAN, NAN, 28), 28, (0, -30, 45)),
        ((-30, 20, 0, 0, 12), 12, (0, -30, 20)),
        ((NAN, NAN, NAN, NAN, 12), 12, (0, 5, 5)),
        ((-100, 200, NAN, NAN, 12), 12, (45, -45, 20)),
        ((NAN, NAN, NAN, NAN, 2), 12, (0, 0, 0)),
        ((NAN, NAN, NAN, NAN, 1), 12, (0, 5, 5)),
    ],
)
def test_what_it_is_asked_for_it_does_as_far_as_it_turns(
    station: Px4Station,
    params: tuple[float, ...],
    flags: int,
    expected: tuple[float, float, float],
) -> None:
    in_control(station).command(PITCHYAW, 5, 5, NAN, NAN, 12)
    station.run(0.3)
    assert station.command(PITCHYAW, *params) == ACCEPTED
    assert angles_deg(station) == near(*expected)
    assert status(station).flags == flags


def test_a_rate_counts_for_two_seconds(station: Px4Station) -> None:
    assert in_control(station).command(PITCHYAW, NAN, NAN, -5, 10, 12) == ACCEPTED
    station.run(4.0)
    roll, pitch, yaw = angles_deg(station)
    assert (roll, pitch, yaw) == pytest.approx((0.0, -10.0, 20.0), abs=0.5)


def test_it_looks_at_a_place_for_anybody_and_then_straight_ahead(station: Px4Station) -> None:
    latitude, longitude = at(10.0, 10.0)
    place = (latitude / 1e7, longitude / 1e7, HOME.altitude_amsl_m - 10.0)
    assert station.command(ROI, 0, 0, 0, 0, *place) == ACCEPTED
    assert angles_deg(station) == pytest.approx((0.0, -35.3, 45.0), abs=1.5)
    assert status(station).flags == 28
    assert station.command(NO_ROI) == ACCEPTED
    assert angles_deg(station) == near(0, 0, 0)


@pytest.mark.parametrize(("stabilises", "yaw_deg"), [(0.0, 100.0), (2.0, 40.0)])
def test_a_locked_yaw_is_from_north_where_the_parameters_say_so(
    stabilises: float, yaw_deg: float
) -> None:
    parameters = {"MNT_MODE_IN": 4.0, "MNT_DO_STAB": stabilises}
    config = VehicleConfig(autopilot="px4", heading_deg=60.0, parameters=parameters)
    station = Px4Station(Simulation([config], seed=1), system=1, component=191)
    station.run(2.0)
    assert in_control(station).command(PITCHYAW, -10, 100, NAN, NAN, 28) == ACCEPTED
    assert angles_deg(station) == pytest.approx((0.0, -10.0, yaw_deg), abs=1.0)
    assert station.last("MOUNT_ORIENTATION").yaw_absolute == pytest.approx(yaw_deg + 60.0, abs=1.0)


def test_streams_of_attitudes_and_rates_point_it_too(station: Px4Station) -> None:
    q = [math.cos(-0.25), 0.0, math.sin(-0.25), 0.0]
    aim = mav.MAVLink_gimbal_manager_set_attitude_message(1, 1, 12, 0, q, NAN, NAN, NAN)
    station.send(aim)
    assert angles_deg(station) == near(0, 0, 0), "not in control"
    in_control(station).send(aim)
    assert angles_deg(station) == near(0, -28.65, 0)
    station.send(
        mav.MAVLink_gimbal_manager_set_manual_control_message(1, 1, 12, 0, NAN, NAN, 0.5, 0.5)
    )
    station.run(4.0)
    assert angles_deg(station) == pytest.approx((0.0, 1.35, 30.0), abs=0.7)


def test_landing_takes_it_turns_it_ahead_and_releases_it(station: Px4Station) -> None:
    in_control(station.take_off())
    assert station.command(PITCHYAW, -30, 20, NAN, NAN, 12) == ACCEPTED
    assert angles_deg(station) == near(0, -30, 20)
    assert station.command(mav.MAV_CMD_NAV_LAND) == ACCEPTED
    station.run(1.0)
    assert angles_deg(station) == near(0, 0, 0)
    report = requested(station, 281)
    assert (report.primary_control_sysid, report.primary_control_compid) == (0, 0)
