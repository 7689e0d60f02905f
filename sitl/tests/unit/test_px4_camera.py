"""A MAVLink camera beside a simulated PX4, by the camera protocol."""

from __future__ import annotations

import pytest
from pymavlink.dialects.v20 import all as mav

from mavlink_sitl import ConfigurationError, Simulation, VehicleConfig
from sitl_support.ground_station import ACCEPTED, UNSUPPORTED
from sitl_support.px4_station import Px4Station

START, STOP = mav.MAV_CMD_IMAGE_START_CAPTURE, mav.MAV_CMD_IMAGE_STOP_CAPTURE
CAMERA, DENIED = 100, 2


@pytest.fixture
def station() -> Px4Station:
    config = VehicleConfig(autopilot="px4", photo_camera=True, links=("onboard", "gcs"))
    station = Px4Station(Simulation([config], seed=1), system=1, component=191)
    station.run(3.0)
    return station


def indices(station: Px4Station) -> list[int]:
    return [m.image_index for m in station.messages("CAMERA_IMAGE_CAPTURED")]


def test_it_is_a_component_of_its_own_and_describes_itself(station: Px4Station) -> None:
    beats = [m for m in station.messages("HEARTBEAT") if m.get_srcComponent() == CAMERA]
    assert len(beats) in (2, 3, 4)
    assert {m.type for m in beats} == {mav.MAV_TYPE_CAMERA}
    for message_id in (259, 260, 262):
        results = station.command_results(mav.MAV_CMD_REQUEST_MESSAGE, message_id, component=CAMERA)
        assert results == [ACCEPTED]
        name = mav.mavlink_map[message_id].msgname
        assert station.last(name).get_srcComponent() == CAMERA
    assert station.last("CAMERA_INFORMATION").flags == mav.CAMERA_CAP_FLAGS_CAPTURE_IMAGE
    assert station.command_results(mav.MAV_CMD_REQUEST_MESSAGE, 30, component=CAMERA) == [
        UNSUPPORTED
    ]


def test_it_takes_each_photo_once_and_only_if_it_is_addressed(station: Px4Station) -> None:
    assert station.command_results(START, 0, 0, 1, 1) == [UNSUPPORTED], "by the autopilot"
    assert station.command_results(START, 0, 0, 1, 1, component=CAMERA) == [ACCEPTED]
    assert station.command_results(START, 0, 0, 1, 1, component=CAMERA) == [ACCEPTED]
    assert station.command_results(START, 0, 0, 1, 2, component=CAMERA) == [ACCEPTED]
    assert indices(station) == [0, 1]


def test_it_takes_photos_at_an_interval_until_it_is_stopped(station: Px4Station) -> None:
    assert station.command_results(START, 0, 0, 0, component=CAMERA) == [DENIED]
    assert station.command_results(START, 0, 0.5, 3, component=CAMERA) == [ACCEPTED]
    station.run(3.0)
    assert indices(station) == [0, 1, 2]
    assert station.command_results(START, 0, 0.5, 0, component=CAMERA) == [ACCEPTED]
    station.run(1.9)
    assert station.command_results(STOP, component=CAMERA) == [ACCEPTED]
    station.run(2.0)
    assert indices(station) == [0, 1, 2, 3, 4, 5, 6]


def test_only_a_px4_has_one() -> None:
    with pytest.raises(ConfigurationError, match="CAM1_TYPE"):
        VehicleConfig(photo_camera=True)
