"""OBSTACLE_DISTANCE and DISTANCE_SENSOR, rule by rule."""

from __future__ import annotations

import math
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mavlink_vehicle.codec import make, mavlink
from mavlink_vehicle.ranges import (
    RangeAxes,
    RangeReader,
    RangesMeasured,
    RangeSource,
    RangesRefused,
)
from mavlink_vehicle.vehicle import Vehicle, VehicleConfig
from tests.support.messages.autopilot_messages import AutopilotMessages

UNKNOWN = 65535
autopilot = AutopilotMessages()


def scan(**fields: object) -> Any:
    """A scan of four sectors with something in the first, over the wire and back."""
    distances = fields.pop("distances", [500, 600, UNKNOWN, 1001])
    assert isinstance(distances, list)
    given_fields: dict[str, object] = {
        "time_usec": 7_000_000,
        "sensor_type": 0,
        "increment": 90,
        "min_distance": 20,
        "max_distance": 1000,
        "frame": mavlink.MAV_FRAME_BODY_FRD,
    }
    filled = distances + [UNKNOWN] * (72 - len(distances))
    return autopilot("OBSTACLE_DISTANCE", **{**given_fields, **fields}, distances=filled)


def beam(**fields: object) -> Any:
    """One beam of 5 m straight ahead."""
    given_fields: dict[str, object] = {
        "time_boot_ms": 7000,
        "min_distance": 20,
        "max_distance": 1000,
        "current_distance": 500,
        "covariance": UNKNOWN & 0xFF,
    }
    return autopilot("DISTANCE_SENSOR", **{**given_fields, **fields})


def read(message: Any) -> RangesMeasured:
    measured = RangeReader().read(message, 1.0)
    assert isinstance(measured, RangesMeasured)
    return measured


def refusal(message: Any) -> str:
    """Why a message is ignored; empty when there is nothing to say about it."""
    reader = RangeReader()
    told = reader.read(message, 1.0)
    assert reader.ignored == 1
    assert not isinstance(told, RangesMeasured)
    return "" if told is None else told.reason


def bearing_deg(measured: RangesMeasured, index: int = 0) -> float:
    x, y, z = measured.directions[index]
    assert math.hypot(x, y, z) == pytest.approx(1.0)
    return math.degrees(math.atan2(y, x)) % 360.0


class TestObstacleDistance:
    def test_sectors_go_clockwise_from_the_nose(self) -> None:
        measured = read(scan())
        assert measured.source is RangeSource.OBSTACLE_DISTANCE
        assert measured.axes is RangeAxes.BODY
        assert bearing_deg(measured) == pytest.approx(0.0)
        assert bearing_deg(measured, 1) == pytest.approx(90.0)
        assert measured.ranges_m[:2] == (5.0, 6.0)
        assert (measured.range_min_m, measured.range_max_m) == (0.2, 10.0)
        assert measured.time_boot_s == 7.0

    def test_the_highest_number_means_unknown_so_that_the_direction_is_left_out(self) -> None:
        assert len(read(scan()).directions) == 3

    def test_more_than_the_reach_means_nothing_within_it(self) -> None:
        measured = read(scan())
        assert measured.ranges_m[2] == math.inf
        assert bearing_deg(measured, 2) == pytest.approx(270.0)

    def test_zero_is_something_that_touches_the_sensor(self) -> None:
        assert read(scan(distances=[0])).ranges_m == (0.0,)

    def test_the_fine_increment_counts_before_the_coarse_one(self) -> None:
        measured = read(scan(increment_f=2.5))
        assert bearing_deg(measured, 1) == pytest.approx(2.5)
        assert measured.width_rad == pytest.approx(math.radians(2.5))

    def test_the_offset_turns_all_sectors(self) -> None:
        assert bearing_deg(read(scan(angle_offset=-45.0))) == pytest.approx(315.0)

    def test_a_second_time_round_is_left_out(self) -> None:
        assert len(read(scan(distances=[500] * 72)).directions) == 4

    def test_all_72_sectors_of_five_degrees_make_one_round(self) -> None:
        assert len(read(scan(distances=[500] * 72, increment=5)).directions) == 72

    @pytest.mark.parametrize(
        ("frame", "axes"),
        [
            (mavlink.MAV_FRAME_GLOBAL, RangeAxes.NORTH),
            (mavlink.MAV_FRAME_LOCAL_NED, RangeAxes.NORTH),
            (mavlink.MAV_FRAME_LOCAL_FRD, RangeAxes.LEVEL),
            (mavlink.MAV_FRAME_BODY_FRD, RangeAxes.BODY),
        ],
    )
    def test_the_frame_says_what_the_sectors_count_from(self, frame: int, axes: RangeAxes) -> None:
        assert read(scan(frame=frame)).axes is axes

    def test_another_frame_is_rejected_and_the_reason_given_once(self) -> None:
        reader = RangeReader()
        told = [reader.read(scan(frame=mavlink.MAV_FRAME_LOCAL_ENU), 1.0) for _ in range(3)]
        assert reader.ignored == 3
        assert isinstance(told[0], RangesRefused)
        assert "frame 4" in told[0].reason
        assert told[1:] == [None, None]

    def test_a_reach_below_the_least_distance_is_rejected(self) -> None:
        assert "max_distance of 10 cm" in refusal(scan(max_distance=10))

    def test_an_increment_of_zero_is_rejected(self) -> None:
        assert "0.0 degrees wide" in refusal(scan(increment=0))

    @pytest.mark.parametrize("field", ["increment_f", "angle_offset"])
    def test_what_is_not_a_number_is_rejected(self, field: str) -> None:
        assert "degrees" in refusal(scan(**{field: math.nan}))

    def test_a_scan_that_knows_nothing_is_no_reading_and_no_mistake(self) -> None:
        assert refusal(scan(distances=[], min_distance=65535, max_distance=0)) == ""


class TestDistanceSensor:
    def test_it_looks_along_its_orientation_in_the_axes_of_the_body(self) -> None:
        measured = read(beam(orientation=mavlink.MAV_SENSOR_ROTATION_YAW_90))
        assert measured.source is RangeSource.DISTANCE_SENSOR
        assert measured.axes is RangeAxes.BODY
        assert bearing_deg(measured) == pytest.approx(90.0)
        assert measured.ranges_m == (5.0,)

    @pytest.mark.parametrize(
        ("orientation", "direction"),
        [
            (mavlink.MAV_SENSOR_ROTATION_NONE, (1.0, 0.0, 0.0)),
            (mavlink.MAV_SENSOR_ROTATION_YAW_225, (-math.sqrt(0.5), -math.sqrt(0.5), 0.0)),
            (mavlink.MAV_SENSOR_ROTATION_ROLL_180_YAW_90, (0.0, 1.0, 0.0)),
            (mavlink.MAV_SENSOR_ROTATION_PITCH_90, (0.0, 0.0, -1.0)),
            (mavlink.MAV_SENSOR_ROTATION_PITCH_270, (0.0, 0.0, 1.0)),
            (mavlink.MAV_SENSOR_ROTATION_PITCH_180_YAW_90, (0.0, -1.0, 0.0)),
            (mavlink.MAV_SENSOR_ROTATION_PITCH_315, (math.sqrt(0.5), 0.0, math.sqrt(0.5))),
        ],
    )
    def test_up_is_a_pitch_of_90_and_down_one_of_270(
        self, orientation: int, direction: tuple[float, float, float]
    ) -> None:
        assert read(beam(orientation=orientation)).directions[0] == pytest.approx(direction)

    def test_every_defined_orientation_is_known(self) -> None:
        for orientation in range(41):
            measured = read(beam(orientation=orientation))
            assert math.hypot(*measured.directions[0]) == pytest.approx(1.0)

    def test_one_that_is_not_defined_is_rejected(self) -> None:
        assert "orientation 77" in refusal(beam(orientation=77))

    def test_a_custom_orientation_is_its_quaternion(self) -> None:
        half = math.sqrt(0.5)
        measured = read(beam(orientation=100, quaternion=[half, 0.0, 0.0, half]))
        assert bearing_deg(measured) == pytest.approx(90.0)
        measured = read(beam(orientation=100, quaternion=[half, 0.0, -half, 0.0]))
        assert measured.directions[0] == pytest.approx((0.0, 0.0, 1.0), abs=1e-6)

    @pytest.mark.parametrize("quaternion", [[0.0] * 4, [math.nan, 0.0, 0.0, 0.0]])
    def test_a_custom_orientation_without_a_rotation_is_rejected(
        self, quaternion: list[float]
    ) -> None:
        assert "quaternion" in refusal(beam(orientation=100, quaternion=quaternion))

    def test_a_signal_quality_of_one_means_an_invalid_reading(self) -> None:
        assert math.isnan(read(beam(signal_quality=1)).ranges_m[0])

    @pytest.mark.parametrize("quality", [0, 2, 100])
    def test_any_other_signal_quality_is_taken(self, quality: int) -> None:
        assert read(beam(signal_quality=quality)).ranges_m == (5.0,)

    @pytest.mark.parametrize("distance_cm", [1000, 1001, 40000])
    def test_the_reach_or_more_means_nothing_within_it(self, distance_cm: int) -> None:
        assert read(beam(current_distance=distance_cm)).ranges_m == (math.inf,)

    @pytest.mark.parametrize("distance_cm", [0, 19, UNKNOWN])
    def test_less_than_it_can_measure_is_no_reading(self, distance_cm: int) -> None:
        assert math.isnan(read(beam(current_distance=distance_cm)).ranges_m[0])

    def test_its_field_of_view_is_the_width_of_the_reading(self) -> None:
        assert read(beam(horizontal_fov=0.2)).width_rad == pytest.approx(0.2)
        assert read(beam(horizontal_fov=math.nan)).width_rad == 0.0

    def test_proximity_sectors_of_an_ardupilot_are_an_eighth_of_the_horizon_wide(self) -> None:
        assert read(beam(id=12, orientation=2)).width_rad == pytest.approx(math.pi / 4)
        upwards = read(beam(id=18, orientation=mavlink.MAV_SENSOR_ROTATION_PITCH_90))
        assert upwards.width_rad == 0.0

    def test_the_covariance_is_a_variance_in_square_centimetres(self) -> None:
        assert read(beam(covariance=25)).deviation_m == pytest.approx(0.05)
        assert read(beam(covariance=255)).deviation_m is None
        assert read(beam(covariance=0)).deviation_m is None


class TestTheVehicle:
    @staticmethod
    def hear(component_id: int, system_id: int = 1) -> list[object]:
        vehicle = Vehicle(VehicleConfig(message_rates_hz={}))
        vehicle.start(0.0)
        vehicle.receive(autopilot.heartbeat(), 0.0)
        sender = AutopilotMessages(system_id, component_id)
        message = sender("DISTANCE_SENSOR", min_distance=20, max_distance=900, current_distance=100)
        vehicle.receive(message, 0.5)
        events: list[object] = []
        while (event := vehicle.next_event()) is not None:
            events.append(event)
        return [event for event in events if isinstance(event, RangesMeasured)]

    @pytest.mark.parametrize("component_id", [1, 191, 158])
    def test_readings_come_from_the_autopilot_or_a_component_beside_it(
        self, component_id: int
    ) -> None:
        (measured,) = self.hear(component_id)
        assert isinstance(measured, RangesMeasured)
        assert measured.component_id == component_id
        assert measured.time_s == 0.5

    def test_another_system_is_not_listened_to(self) -> None:
        assert self.hear(1, system_id=2) == []


u8, u16 = st.integers(0, 255), st.integers(0, 65535)
real = st.floats(width=32)


@given(
    distances=st.lists(u16, min_size=72, max_size=72),
    fields=st.fixed_dictionaries(
        {
            "time_usec": st.integers(0, 2**64 - 1), "sensor_type": u8, "increment": u8,
            "min_distance": u16, "max_distance": u16, "increment_f": real, "angle_offset": real,
            "frame": u8,
        }
    ),
)  # fmt: skip
def test_any_scan_is_read_or_ignored(distances: list[int], fields: dict[str, object]) -> None:
    check(make("OBSTACLE_DISTANCE", distances=distances, **fields))


@given(
    fields=st.fixed_dictionaries(
        {
            "time_boot_ms": st.integers(0, 2**32 - 1), "min_distance": u16, "max_distance": u16,
            "current_distance": u16, "type": u8, "id": u8, "orientation": u8, "covariance": u8,
            "horizontal_fov": real, "vertical_fov": real, "signal_quality": u8,
            "quaternion": st.lists(real, min_size=4, max_size=4),
        }
    )
)  # fmt: skip
def test_any_beam_is_read_or_ignored(fields: dict[str, object]) -> None:
    check(make("DISTANCE_SENSOR", **fields))


def check(message: Any) -> None:
    (message,) = AutopilotMessages()._decoder.decode(AutopilotMessages()._encoder.encode(message))
    reader = RangeReader()
    measured = reader.read(message, 1.0)
    assert isinstance(measured, RangesMeasured) == (reader.ignored == 0)
    if isinstance(measured, RangesMeasured):
        assert len(measured.directions) == len(measured.ranges_m) > 0
        for direction in measured.directions:
            assert math.hypot(*direction) == pytest.approx(1.0, abs=1e-4)
        told = [r for r in measured.ranges_m if not math.isnan(r)]
        assert all(0.0 <= r <= measured.range_max_m or r == math.inf for r in told)
