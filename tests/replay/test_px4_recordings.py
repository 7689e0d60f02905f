"""The recorded conversations with the real PX4 v1.17, played into the simulated one.

What is meant to differ stands here, each with its reason; nothing else may.
"""

from __future__ import annotations

import functools
import math
from pathlib import Path

import pytest

from mavlink_sitl.compare import (
    Conversation,
    acknowledgements,
    changes,
    landed_states,
    load,
    main,
    mission_acknowledgements,
    modes,
    replay,
    report,
    rms_distance_m,
    texts,
    track,
)

DATA = Path(__file__).parent / "data"
FLIGHTS = ("offboard_10m_20n_gt", "offboard_loss_stop", "mavsdk_offboard_goto")
NAMES = (*FLIGHTS, "probe_ground")

DIFFERENT_LANDED_STATES = {
    "offboard_loss_stop": (
        [1, 2, 4, 1, 4, 1],
        "the real landing detector flapped once while its height estimate drifted by a metre",
    )
}

OFFBOARD_FROM_TO_S = {
    "offboard_10m_20n_gt": (10.7, 35.8),
    "offboard_loss_stop": (12.2, 27.2),
    "mavsdk_offboard_goto": (10.3, 22.7),
}
"""From arming to the end of OFFBOARD, seconds since power-up"""


@functools.cache
def conversation(name: str) -> Conversation:
    return replay(load(DATA / f"px4_{name}.tlog"))


@pytest.mark.parametrize("name", NAMES)
def test_every_command_is_answered_as_the_real_one_answered(name: str) -> None:
    flight = conversation(name)
    assert acknowledgements(flight.ours) == acknowledgements(flight.real)


@pytest.mark.parametrize("name", NAMES)
def test_every_mission_is_acknowledged_as_the_real_one_did(name: str) -> None:
    flight = conversation(name)
    assert mission_acknowledgements(flight.ours) == mission_acknowledgements(flight.real)


@pytest.mark.parametrize("name", NAMES)
def test_the_heartbeat_goes_through_the_same_modes_and_states(name: str) -> None:
    flight = conversation(name)
    assert modes(flight.ours) == modes(flight.real)


@pytest.mark.parametrize("name", FLIGHTS)
def test_modes_change_within_a_heartbeat_of_the_recording(name: str) -> None:
    """After landing the sky decides: there within a tenth of the time in the air."""
    flight = conversation(name)
    fields = ("HEARTBEAT", "custom_mode", "base_mode", "system_status")
    real, ours = changes(flight.real, *fields), changes(flight.ours, *fields)
    begin_s = real[0][0]
    for (real_s, values), (our_s, _) in zip(real, ours, strict=True):
        last = values == real[-1][1]
        limit_s = 1.1 + (0.15 * (real_s - begin_s) if last else 0.0)
        assert our_s == pytest.approx(real_s, abs=limit_s), values


@pytest.mark.parametrize("name", NAMES)
def test_landed_states_come_in_the_same_order(name: str) -> None:
    flight = conversation(name)
    real = landed_states(flight.real)
    if name in DIFFERENT_LANDED_STATES:
        assert real == DIFFERENT_LANDED_STATES[name][0]
        real = real[:4]
    assert landed_states(flight.ours) == real


@pytest.mark.parametrize("name", FLIGHTS)
def test_intended_and_flown_mode_are_those_of_the_recording(name: str) -> None:
    flight = conversation(name)
    fields = ("CURRENT_MODE", "standard_mode", "custom_mode", "intended_custom_mode")
    ours = [values for _, values in changes(flight.ours, *fields)]
    assert ours == [values for _, values in changes(flight.real, *fields)]


@pytest.mark.parametrize("name", FLIGHTS)
def test_the_position_in_offboard_is_within_a_metre_and_a_half(name: str) -> None:
    flight = conversation(name)
    distance_m = rms_distance_m(track(flight.real), track(flight.ours), *OFFBOARD_FROM_TO_S[name])
    assert distance_m < 1.5


@pytest.mark.parametrize("name", FLIGHTS)
def test_the_whole_flight_stays_close_to_the_recorded_one(name: str) -> None:
    """Coasting, return and landing, too, though the goal is for OFFBOARD only."""
    flight = conversation(name)
    begin_s = OFFBOARD_FROM_TO_S[name][0]
    distance_m = rms_distance_m(track(flight.real), track(flight.ours), begin_s, math.inf)
    assert distance_m < 2.0


TARGETS = [
    ("offboard_10m_20n_gt", (0.085, -0.18, -9.0), 10.7, 1.2),
    ("offboard_10m_20n_gt", (20.085, -0.18, -10.0), 23.7, 1.2),
    ("offboard_loss_stop", (-0.25, 0.11, -9.0), 12.2, 1.2),
    ("mavsdk_offboard_goto", (-0.23, 0.11, -9.0), 10.3, 1.2),
    ("mavsdk_offboard_goto", (19.77, 0.11, -10.0), 18.3, 1.2),
    ("mavsdk_offboard_goto", (-10.2, 0.0, -14.0), 24.7, 2.0),
]


def arrival_s(
    flight: list[tuple[float, float, float, float]],
    target: tuple[float, float, float],
    from_s: float,
    within_m: float,
) -> float:
    for time_s, *position in flight:
        if time_s >= from_s and math.dist(position, target) <= within_m:
            return time_s - from_s
    raise AssertionError(f"never within {within_m} m of {target}")


@pytest.mark.parametrize(("name", "target", "from_s", "within_m"), TARGETS)
def test_the_time_to_each_target_is_within_10_percent(
    name: str, target: tuple[float, float, float], from_s: float, within_m: float
) -> None:
    flight = conversation(name)
    expected = arrival_s(track(flight.real), target, from_s, within_m)
    ours = arrival_s(track(flight.ours), target, from_s, within_m)
    assert ours == pytest.approx(expected, rel=0.1)


def test_texts_come_on_the_companions_link_only_after_a_heartbeat_of_a_ground_station() -> None:
    flight = conversation("probe_ground")
    # What the real one says about a list that is not there came once more, 1.2 s late.
    ours = [text for text in texts(flight.ours) if not text.startswith("WPM")]
    real = [text for text in texts(flight.real) if not text.startswith("WPM")]
    assert ours == real[: len(ours)]
    assert ours


def test_health_says_ready_whenever_the_real_one_did() -> None:
    flight = conversation("probe_ground")
    ready = 0x10000000

    def verdicts(messages: list[tuple[float, object]]) -> list[bool]:
        found: list[bool] = []
        for _, (health,) in changes(messages, "SYS_STATUS", "onboard_control_sensors_health"):
            if not found or found[-1] != bool(health & ready):
                found.append(bool(health & ready))
        return found

    assert verdicts(flight.ours) == verdicts(flight.real)


def test_the_comparison_is_a_command(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    assert main([str(DATA / "px4_offboard_10m_20n_gt.tlog")]) == 0
    said = capsys.readouterr().out
    assert "same  command acknowledgements: 4 recorded" in said
    assert "m apart" in said
    assert main([str(tmp_path / "missing.tlog")]) == 2
    assert "missing.tlog" in capsys.readouterr().err
    (tmp_path / "empty.tlog").write_bytes(b"")
    assert main([str(tmp_path / "empty.tlog")]) == 2
    assert "known vehicles" in capsys.readouterr().err


def test_a_difference_is_shown_and_makes_the_command_fail() -> None:
    lines, equal = report(conversation("offboard_loss_stop"))
    assert not equal
    assert any(line.startswith("DIFFERENT  landed states") for line in lines)
    assert "    simulated  [1, 2, 4, 1]" in lines
