"""Broad: random intruders, one to three at once, against each kind that setpoints lead."""

from __future__ import annotations

import pytest

from tests.fleets.encounters import (
    Intruder,
    begin,
    can_keep_apart,
    meet,
    random_encounter,
    turning_encounter,
)

pytestmark = [pytest.mark.night, pytest.mark.timeout(1500)]


def passes(intruders: list[Intruder], seed: int) -> None:
    """Check that one vehicle, by the seed of one firmware and speed, keeps apart if it can."""
    autopilot = ("ardupilot", "px4")[seed % 2]
    speed_m_s = (4.0, 8.0)[seed // 2 % 2]
    flown = meet(begin(autopilot=autopilot, speed_m_s=speed_m_s), intruders, speed_m_s=speed_m_s)
    assert flown.share >= 1.0 or not can_keep_apart(intruders, flown, speed_m_s), flown
    assert flown.code in ("SUCCESS", "TRAFFIC")


@pytest.mark.parametrize("seed", range(5))
def test_a_copter_keeps_apart_wherever_it_can(seed: int) -> None:
    passes(random_encounter(seed), seed)


@pytest.mark.parametrize("seed", range(12))
def test_a_copter_keeps_apart_from_those_that_turn_hard(seed: int) -> None:
    passes(turning_encounter(seed), seed)


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("kind", ["rover", "boat"])
def test_what_drives_ends_and_keeps_apart_from_those_that_come_late(kind: str, seed: int) -> None:
    intruders = [one for one in random_encounter(seed, climbs=False) if one.meets_s > 8.0]
    flown = meet(begin(kind), intruders, height_m=0.0)
    assert flown.share >= 1.0, flown
    assert flown.code in ("SUCCESS", "TRAFFIC")
