"""Single rules that the recordings show, beyond what every recording is compared by."""

from __future__ import annotations

import itertools
import math

import pytest

from comparison.motion import track
from comparison.recording import Timed
from sitl_support.recorded_flights import each, flight, of, texts, values

pytestmark = [pytest.mark.wide, pytest.mark.xdist_group("recordings")]  # each is played once


def sides(name: str) -> tuple[Timed, Timed]:
    """The messages of the real vehicle and of the simulated one."""
    played = flight(name)
    return played.real, played.ours


def upto(side: Timed, end_s: float) -> Timed:
    return [(time_s, message) for time_s, message in side if time_s < end_s]


MISSION_FIELDS = ("seq", "total", "mission_state", "mission_mode")
MISSION_ANSWERS = ("MISSION_REQUEST", "MISSION_REQUEST_INT", "MISSION_ACK", "MISSION_COUNT")
MISSIONS = ("copter_auto_cleared", "rover_auto", "mission_clear")


def transfers(messages: Timed) -> list[tuple[object, ...]]:
    kept = [m for _, m in messages if m.get_type() in MISSION_ANSWERS]
    return [(m.get_type(), getattr(m, "seq", None), getattr(m, "type", None)) for m in kept]


@pytest.mark.parametrize("name", each(*MISSIONS))
def test_a_mission_is_asked_for_and_acknowledged_in_the_same_order(name: str) -> None:
    real, ours = sides(name)
    assert transfers(ours) == transfers(real)


@pytest.mark.parametrize("name", each(*MISSIONS))
def test_mission_current_goes_through_the_same_states(name: str) -> None:
    real, ours = sides(name)
    assert values(ours, "MISSION_CURRENT", *MISSION_FIELDS) == values(
        real, "MISSION_CURRENT", *MISSION_FIELDS
    )


@pytest.mark.parametrize("name", each("copter_auto_cleared", "mission_clear"))
def test_items_read_back_are_the_recorded_ones(name: str) -> None:
    real, ours = (
        [str(m) for _, m in side if m.get_type() == "MISSION_ITEM_INT"] for side in sides(name)
    )
    assert real
    assert ours == real


@of("copter_auto_cleared")
def test_each_leg_of_a_copters_mission_takes_as_long() -> None:
    """Corners are cut: from one MISSION_ITEM_REACHED to the next, within 10 percent."""

    def legs(messages: Timed) -> list[float]:
        times = [t for t, m in messages if m.get_type() == "MISSION_ITEM_REACHED"]
        return [after - before for before, after in itertools.pairwise(times)]

    real, ours = sides("copter_auto_cleared")
    assert legs(ours) == pytest.approx(legs(real), rel=0.1)


# Rovers.


@of("rover_guided")
def test_a_rejected_acceleration_is_reported_in_two_chunks_every_time() -> None:
    real, ours = (
        [text for text in texts(side) if "NORE in mask" in text] for side in sides("rover_guided")
    )
    assert real
    assert len(ours) == len(real)


def arrivals(messages: Timed) -> list[float]:
    return [t for t, m in messages if m.get_type() == "MISSION_ITEM_REACHED" and m.seq == 0]


@of("rover_guided")
def test_rover_reports_each_arrival_as_item_0_in_time() -> None:
    real, ours = map(arrivals, sides("rover_guided"))
    sent_s = [48.37, 62.35, 75.06, 133.12]
    assert len(real) == 4
    took = [[at - begin for at, begin in zip(side, sent_s, strict=True)] for side in (real, ours)]
    assert took[1] == pytest.approx(took[0], rel=0.1)


@of("rover_auto")
def test_rover_takes_as_long_to_each_item() -> None:
    """The way to item 4 was begun again by the second upload: its time says nothing.

    HOLD before item 2 stops it 2 m farther from there.
    """
    real, ours = (
        [t for t, m in side if m.get_type() == "MISSION_ITEM_REACHED"]
        for side in sides("rover_auto")
    )
    begin_s = [(42.49, 42.49), (55.59, 55.59), (60.96, ours[1])]
    for real_s, our_s, (real_from_s, our_from_s) in zip(real[:3], ours[:3], begin_s, strict=True):
        assert our_s - our_from_s == pytest.approx(real_s - real_from_s, rel=0.15)


# Planes.


def height_reached_s(played: Timed, height_m: float) -> float:
    return next(float(t) for t, _, _, down in track(played) if -down >= height_m)


@of("plane_guided")
@pytest.mark.parametrize(
    ("height_m", "from_s"),
    [(10.0, 25.87), (25.0, 25.87), (40.0, 25.87), (49.0, 25.87), (97.0, 69.9)],
)
def test_plane_climbs_as_fast_after_take_off_and_for_rtl(height_m: float, from_s: float) -> None:
    real, ours = (height_reached_s(side, height_m) - from_s for side in sides("plane_guided"))
    assert ours == pytest.approx(real, rel=0.1)


def near_s(played: Timed, centre: tuple[float, float], radius_m: float, from_s: float) -> float:
    """Time until the plane is within a distance of a point."""
    for t, north, east, _ in track(played):
        if t >= from_s and math.dist((north, east), centre) <= radius_m:
            return float(t) - from_s
    raise AssertionError("never near")


@of("plane_guided")
@pytest.mark.parametrize(
    ("centre", "radius_m", "from_s"), [((300.0, 100.0), 95.0, 51.8), ((0.0, 0.0), 100.0, 69.9)]
)
def test_plane_takes_as_long_to_the_circles_of_reposition_and_rtl(
    centre: tuple[float, float], radius_m: float, from_s: float
) -> None:
    real, ours = (near_s(side, centre, radius_m, from_s) for side in sides("plane_guided"))
    assert ours == pytest.approx(real, rel=0.1)


@of("plane_guided")
def test_plane_ignores_the_local_setpoints_of_the_recording() -> None:
    """300 m north by LOCAL_NED and GLOBAL_INT: both went on circling where GUIDED began."""
    for side in sides("plane_guided"):
        places = [(n, e) for t, n, e, _ in track(side) if 45.0 < t < 51.0]
        assert places
        assert all(math.dist(place, (228.0, -107.0)) < 135.0 for place in places)


@of("plane_guided")
def test_plane_reports_that_it_circles_as_item_0() -> None:
    real, ours = map(arrivals, sides("plane_guided"))
    assert len(ours) == len(real) == 2


# PX4.


@pytest.mark.parametrize(
    "name", each("offboard_10m_20n_gt", "offboard_loss_stop", "mavsdk_offboard_goto")
)
def test_intended_and_flown_mode_are_those_of_the_recording(name: str) -> None:
    fields = ("CURRENT_MODE", "standard_mode", "custom_mode", "intended_custom_mode")
    # It comes every 2 s: a change just before the end may have been reported by one of them only.
    real, ours = (upto(side, flight(name).real[-1][0] - 2.0) for side in sides(name))
    assert values(ours, *fields) == values(real, *fields)


@of("probe_ground")
def test_texts_come_on_the_companions_link_only_after_a_heartbeat_of_a_ground_station() -> None:
    # The real one repeated its text about a missing list (WPM) once, 1.2 s later.
    real, ours = (
        [text for text in texts(side) if not text.startswith("WPM")]
        for side in sides("probe_ground")
    )
    assert ours == real[: len(ours)]
    assert ours


@of("probe_ground")
def test_health_says_ready_whenever_the_real_one_did() -> None:
    def verdicts(messages: Timed) -> list[bool]:
        health = values(messages, "SYS_STATUS", "onboard_control_sensors_health")
        ready = [bool(bits & 0x10000000) for (bits,) in health]
        return [bit for bit, _ in itertools.groupby(ready)]

    real, ours = sides("probe_ground")
    assert verdicts(ours) == verdicts(real)


@of("mission_clear")
def test_px4_reaches_the_items_that_the_real_one_reached() -> None:
    real, ours = (values(side, "MISSION_ITEM_REACHED", "seq") for side in sides("mission_clear"))
    assert real
    assert ours == real
