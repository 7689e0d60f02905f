"""The gimbal and the camera of a simulated vehicle, for clients and beside goals."""

from __future__ import annotations

import math

import pytest

from mavlink_sitl import VehicleConfig
from mavlink_vehicle.events import PhotoReported
from navigation_bridge.requests.payload_requests import (
    GimbalMode,
    GimbalReport,
    PayloadDone,
    PayloadRequests,
    PointGimbalRequest,
)
from navigation_core.outcomes import OutcomeCode
from tests.support.flights.simulated_flight import SimulatedFlight

DOWN = PointGimbalRequest(GimbalMode.ANGLE, -math.pi / 2, 0.5)


def flight_of(autopilot: str = "ardupilot", **parameters: float) -> SimulatedFlight:
    simulated = VehicleConfig(
        autopilot=autopilot, heading_deg=60.0, ready_after_s=1.0, parameters=parameters
    )
    return SimulatedFlight(simulated=simulated).ready()


@pytest.fixture
def flight() -> SimulatedFlight:
    return flight_of(CAM1_TYPE=1.0, MNT1_TYPE=1.0)


def point(flight: SimulatedFlight, request: PointGimbalRequest) -> PayloadDone:
    done: list[PayloadDone] = []
    flight.bridge.feature(PayloadRequests).point(request, done.append, flight.now)
    flight.run_until(lambda: bool(done), 60.0)
    assert len(done) == 1
    return done[0]


def test_a_gimbal_is_pointed_and_reports_where(flight: SimulatedFlight) -> None:
    payload = flight.simulation.vehicles[0].firmware.payload
    requests, heard = flight.bridge.feature(PayloadRequests), []  # type: ignore[var-annotated]
    requests.on_gimbal = heard.append
    assert point(flight, DOWN).code is OutcomeCode.SUCCESS
    flight.run_for(1.0)
    assert payload.pitch_deg == pytest.approx(-90.0)
    assert payload.yaw_deg == pytest.approx(-math.degrees(0.5)), "clockwise there"
    assert payload.control == (1, 191)
    assert requests.is_there(DOWN, flight.now) is True
    assert requests.is_there(PointGimbalRequest(GimbalMode.ANGLE, 0.0, 0.5), flight.now) is False
    report = heard[-1]
    assert isinstance(report, GimbalReport)
    assert report.pitch_rad == pytest.approx(-math.pi / 2, abs=1e-3)
    assert not report.yaw_locked


def test_a_locked_yaw_is_from_east_whatever_the_vehicle_faces(flight: SimulatedFlight) -> None:
    payload = flight.simulation.vehicles[0].firmware.payload
    north = PointGimbalRequest(GimbalMode.ANGLE, -0.3, math.pi / 2, yaw_locked=True)
    assert point(flight, north).code is OutcomeCode.SUCCESS
    flight.run_for(1.0)
    assert payload.yaw_locked
    assert payload.yaw_deg == pytest.approx(0.0, abs=1e-3)
    assert flight.bridge.feature(PayloadRequests).is_there(north, flight.now) is True


@pytest.mark.parametrize(
    ("device", "stabilises", "reached"), [(0.0, 0.0, False), (0.0, 2.0, True), (2.0, 0.0, True)]
)
def test_a_px4_with_a_gimbal_points_it_and_says_whether_it_is_there(
    device: float, stabilises: float, reached: bool
) -> None:
    """Device 2 is one with MAVLink. A servo that is not stabilised is not where it should be."""
    flight = flight_of(
        "px4",
        MNT_MODE_IN=4.0,
        MNT_MODE_OUT=device,
        MNT_RANGE_PITCH=180.0,
        MNT_DO_STAB=stabilises,
    )
    requests = flight.bridge.feature(PayloadRequests)
    payload = flight.simulation.vehicles[0].firmware.payload
    assert point(flight, DOWN).code is OutcomeCode.SUCCESS
    flight.run_for(1.0)
    assert payload.pitch_deg == pytest.approx(-90.0)
    assert requests.is_there(DOWN, flight.now) is True
    assert payload.control == (1, 191)
    north = PointGimbalRequest(GimbalMode.ANGLE, -0.3, math.pi, yaw_locked=True)
    assert point(flight, north).code is OutcomeCode.SUCCESS
    flight.run_for(1.0)
    assert requests.is_there(north, flight.now) is reached
    assert point(flight, PointGimbalRequest(GimbalMode.NONE)).code is OutcomeCode.SUCCESS
    assert payload.control == (0, 0)


def test_a_gimbal_follows_a_position_beside_a_goal_and_lets_it_go(
    flight: SimulatedFlight,
) -> None:
    payload = flight.simulation.vehicles[0].firmware.payload
    flight.fly_up()
    goal_id = flight.send(20.0, 0.0, 3.0)
    target = PointGimbalRequest(GimbalMode.POINT, frame_id="map", target=(10.0, 20.0, 0.0))
    assert point(flight, target).code is OutcomeCode.SUCCESS
    assert flight.run_to_end(goal_id).code is OutcomeCode.SUCCESS
    pitch_rad, yaw_rad, _ = payload.angles_rad()
    east, north, up = flight.truth()[0]
    assert yaw_rad == pytest.approx(math.atan2(10.0 - east, 20.0 - north), abs=0.05)
    assert pitch_rad == pytest.approx(
        -math.atan2(up, math.hypot(10.0 - east, 20.0 - north)), abs=0.05
    )
    assert point(flight, PointGimbalRequest(GimbalMode.NONE)).code is OutcomeCode.SUCCESS
    assert payload.target is None
    assert payload.control == (0, 0)


def photographed(flight: SimulatedFlight) -> tuple[list[PhotoReported], list[PayloadDone]]:
    """Ask for a photo; return the reports and the answers that came of it."""
    requests = flight.bridge.feature(PayloadRequests)
    photos: list[PhotoReported] = []
    done: list[PayloadDone] = []
    requests.on_photo = photos.append
    requests.take_photo(done.append, flight.now)
    flight.run_for(2.0)
    return photos, done


def test_a_photo_is_taken_once_and_reported_with_its_place(flight: SimulatedFlight) -> None:
    payload = flight.simulation.vehicles[0].firmware.payload
    photos, done = photographed(flight)
    assert [each.code for each in done] == [OutcomeCode.SUCCESS]
    assert payload.photos == 1
    (photo,) = photos
    place = flight.vehicle.state.global_position
    assert place is not None
    assert photo.place[0] == pytest.approx(place.latitude_deg, abs=1e-6)


def test_a_photo_of_a_px4_is_taken_by_the_camera_beside_it() -> None:
    simulated = VehicleConfig(autopilot="px4", ready_after_s=1.0, photo_camera=True)
    flight = SimulatedFlight(simulated=simulated).ready()
    photos, done = photographed(flight)
    assert [each.code for each in done] == [OutcomeCode.SUCCESS], done
    assert [photo.success for photo in photos] == [True]
    assert flight.simulation.vehicles[0].firmware.payload.photos == 1


@pytest.mark.parametrize(
    ("request_", "code", "text"),
    [
        (PointGimbalRequest(None), OutcomeCode.INVALID_NUMBER, "mode is unknown"),
        (
            PointGimbalRequest(GimbalMode.ANGLE, math.nan),
            OutcomeCode.INVALID_NUMBER,
            "pitch is nan",
        ),
        (PointGimbalRequest(GimbalMode.ANGLE, 2.0), OutcomeCode.INVALID_NUMBER, "give a pitch of"),
        (
            PointGimbalRequest(GimbalMode.POINT, target=(0.0, math.inf, 0.0)),
            OutcomeCode.INVALID_NUMBER,
            "every number must be finite",
        ),
        (
            PointGimbalRequest(GimbalMode.POINT, frame_id="moon"),
            OutcomeCode.UNKNOWN_FRAME,
            "Unknown frame 'moon'",
        ),
        (PointGimbalRequest(GimbalMode.VEHICLE), OutcomeCode.INVALID_NUMBER, "system_id is 0"),
        (
            PointGimbalRequest(GimbalMode.ANGLE, 1.5),
            OutcomeCode.ACT_FAILED,
            "DO_GIMBAL_MANAGER_PITCHYAW was answered with FAILED",
        ),
    ],
)
def test_a_bad_request_is_rejected_with_a_reason(
    flight: SimulatedFlight, request_: PointGimbalRequest, code: OutcomeCode, text: str
) -> None:
    payload = flight.simulation.vehicles[0].firmware.payload
    done = point(flight, request_)
    assert done.code is code
    assert text in done.message
    assert payload.pitch_deg == 0.0


def test_a_vehicle_without_a_gimbal_and_one_that_is_silent_say_so() -> None:
    flight = flight_of()
    done = point(flight, DOWN)
    assert done.code is OutcomeCode.UNSUPPORTED_VEHICLE
    assert "no gimbal (MNT1_TYPE is 0)" in done.message
    flight = flight_of(MNT1_TYPE=1.0)
    flight.uplink_up = False
    done = point(flight, DOWN)
    assert done.code is OutcomeCode.ACT_FAILED
    assert "was not answered" in done.message


def test_a_px4_without_a_gimbal_does_not_point_at_a_place_either() -> None:
    # It accepts the place all the same: whoever has a gimbal would look there.
    flight = flight_of("px4")
    place = PointGimbalRequest(GimbalMode.POINT, frame_id="map", target=(20.0, 0.0, 0.0))
    done = point(flight, place)
    assert done.code is OutcomeCode.ACT_FAILED
    assert "DO_GIMBAL_MANAGER_CONFIGURE was not answered" in done.message


def test_one_request_at_a_time(flight: SimulatedFlight) -> None:
    requests = flight.bridge.feature(PayloadRequests)
    first: list[PayloadDone] = []
    second: list[PayloadDone] = []
    requests.point(DOWN, first.append, flight.now)
    requests.take_photo(second.append, flight.now)
    flight.run_for(3.0)
    assert [each.code for each in first] == [OutcomeCode.SUCCESS]
    assert [each.code for each in second] == [OutcomeCode.BUSY]
