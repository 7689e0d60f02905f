"""Frames: every round trip, every heading, and signs against known facts."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mavlink_vehicle.positions import frames
from mavlink_vehicle.positions.frames import Quaternion, Vector3

LENGTH = st.floats(-1e5, 1e5)
VECTOR = st.tuples(LENGTH, LENGTH, LENGTH)
ANGLE = st.floats(-20.0, 20.0)
HEADINGS_DEG = range(-360, 721)
SQRT_HALF = math.sqrt(0.5)


def close(left: Vector3 | Quaternion, right: Vector3 | Quaternion, tolerance: float) -> bool:
    return all(abs(a - b) <= tolerance for a, b in zip(left, right, strict=True))


def same_direction(left_rad: float, right_rad: float) -> bool:
    return abs(math.remainder(left_rad - right_rad, math.tau)) < 1e-9


def rotate(quaternion: Quaternion, vector: Vector3) -> Vector3:
    """Turn a vector by a quaternion, by way of the rotation matrix."""
    w, x, y, z = np.array(quaternion) / np.linalg.norm(quaternion)
    matrix = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
    east, north, up = matrix @ np.array(vector)
    return (float(east), float(north), float(up))


def yaw_of(quaternion: Quaternion) -> float:
    """Return the direction of the nose about z."""
    x, y, _ = rotate(quaternion, (1.0, 0.0, 0.0))
    return math.atan2(y, x)


# Facts


def test_known_vectors() -> None:
    assert frames.ned_to_enu((1.0, 2.0, 3.0)) == (2.0, 1.0, -3.0)
    assert frames.enu_to_ned((1.0, 2.0, 3.0)) == (2.0, 1.0, -3.0)


@pytest.mark.parametrize(
    ("enu_deg", "ned_deg"),
    [(0, 90), (90, 0), (180, -90), (-90, 180), (45, 45), (135, -45), (-45, 135)],
)
def test_known_headings(enu_deg: int, ned_deg: int) -> None:
    """Facing east is ENU yaw 0 and NED yaw +90 degrees; north is ENU +90 and NED 0."""
    enu, ned = math.radians(enu_deg), math.radians(ned_deg)
    assert frames.yaw_enu_to_ned(enu) == pytest.approx(ned)
    assert frames.yaw_ned_to_enu(ned) == pytest.approx(enu)


def test_every_heading_in_every_frame() -> None:
    for degrees in HEADINGS_DEG:
        check_heading(degrees)


def check_heading(degrees: int) -> None:
    yaw_ned = math.radians(degrees)
    yaw_enu = frames.yaw_ned_to_enu(yaw_ned)
    assert -math.pi < yaw_enu <= math.pi
    assert same_direction(frames.yaw_enu_to_ned(yaw_enu), yaw_ned)
    # The nose points the same way in both frames.
    nose_ned = (math.cos(yaw_ned), math.sin(yaw_ned), 0.0)
    nose_enu = (math.cos(yaw_enu), math.sin(yaw_enu), 0.0)
    assert close(frames.ned_to_enu(nose_ned), nose_enu, 1e-9)
    assert close(frames.body_flu_to_enu((1.0, 0.0, 0.0), yaw_enu), nose_enu, 1e-9)
    # Left of the nose is 90 degrees counter-clockwise seen from above.
    left = frames.body_flu_to_enu((0.0, 1.0, 0.0), yaw_enu)
    assert close(left, (-nose_enu[1], nose_enu[0], 0.0), 1e-9)
    # And the same as quaternions.
    level_ned = frames.quaternion_from_yaw(yaw_ned)
    level_enu = frames.quaternion_ned_frd_to_enu_flu(level_ned)
    assert same_direction(yaw_of(level_ned), yaw_ned)
    assert same_direction(yaw_of(level_enu), yaw_enu)
    assert close(rotate(level_enu, (0.0, 0.0, 1.0)), (0.0, 0.0, 1.0), 1e-9)  # still upright


def test_a_known_attitude() -> None:
    """Nose up and facing north: pitch is positive in FRD/NED, negative in FLU/ENU."""
    ned = frames.quaternion_from_euler(0.0, math.radians(30.0), 0.0)
    enu = frames.quaternion_ned_frd_to_enu_flu(ned)
    nose = rotate(enu, (1.0, 0.0, 0.0))
    assert close(nose, (0.0, math.cos(math.radians(30.0)), 0.5), 1e-12)
    east = frames.quaternion_ned_frd_to_enu_flu((SQRT_HALF, 0.0, 0.0, SQRT_HALF))
    assert yaw_of(east) == pytest.approx(0.0, abs=1e-12)


# There and back


@given(VECTOR)
def test_vectors_round_trip(vector: Vector3) -> None:
    assert frames.enu_to_ned(frames.ned_to_enu(vector)) == vector


@given(VECTOR, ANGLE)
def test_body_round_trips_and_keeps_lengths(vector: Vector3, yaw: float) -> None:
    enu = frames.body_flu_to_enu(vector, yaw)
    assert close(frames.body_flu_to_enu(enu, -yaw), vector, 1e-9 * (1.0 + math.hypot(*vector)))
    assert math.hypot(*enu) == pytest.approx(math.hypot(*vector))


@given(ANGLE)
def test_normalizing_keeps_the_direction_and_is_final(angle: float) -> None:
    normal = frames.normalize_angle(angle)
    assert -math.pi < normal <= math.pi
    assert same_direction(normal, angle)
    assert frames.normalize_angle(normal) == normal


def test_normalizing_at_the_seam() -> None:
    assert frames.normalize_angle(math.pi) == math.pi
    assert frames.normalize_angle(-math.pi) == math.pi
    assert math.isnan(frames.normalize_angle(math.inf))
    assert math.isnan(frames.normalize_angle(math.nan))


@given(ANGLE, st.floats(-1.5, 1.5), ANGLE)
def test_attitudes_agree_with_vectors(roll: float, pitch: float, yaw: float) -> None:
    ned = frames.quaternion_from_euler(roll, pitch, yaw)
    enu = frames.quaternion_ned_frd_to_enu_flu(ned)
    for forward, left, up in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (0.3, -0.5, 0.8)):
        body_flu = (forward, left, up)
        in_ned = rotate(ned, (forward, -left, -up))
        assert close(rotate(enu, body_flu), frames.ned_to_enu(in_ned), 1e-9)
    if abs(pitch) < 1.4:
        assert same_direction(yaw_of(ned), yaw)
