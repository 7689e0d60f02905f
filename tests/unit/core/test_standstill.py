"""Standstill detection over a window of positions."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from mavlink_vehicle.codec import Codec
from mavlink_vehicle.io.tlog import TlogReader
from navigation_core.geometry import Vector3
from navigation_core.tasks.goto_config import GotoConfig
from navigation_core.tasks.observation import Observation
from navigation_core.tasks.standstill import Standstill
from navigation_core.tasks.traits import Traits
from tests.support.logs.recordings import SMALL
from tests.support.models.point_mass import PointMass

PX4_HOLD = SMALL / "px4_mission_clear.tlog"
STALE_S = 1.0


def standstill() -> Standstill:
    return Standstill(0.3, 1.0)


def at(time_s: float, place: Vector3, velocity: Vector3 = (0.0, 0.0, 0.0)) -> Observation:
    observation = PointMass(position=place, velocity=velocity, armed=True).observe()
    return replace(observation, time_s=time_s)


def seen(still: Standstill, *observations: Observation) -> list[bool]:
    return [still.holds(observation, STALE_S) for observation in observations]


def test_it_takes_a_whole_window() -> None:
    times = [0.05 * step for step in range(30)]
    verdicts = seen(standstill(), *(at(time_s, (1.0, 2.0, 3.0)) for time_s in times))
    assert verdicts == [time_s > 0.99 for time_s in times]


def test_without_a_dwell_it_still_looks_at_a_few_positions() -> None:
    observations = [at(0.1 * step, (0.0, 0.0, 5.0)) for step in range(8)]
    verdicts = seen(Standstill(0.3, 0.0), *observations)
    assert not verdicts[0]
    assert verdicts[-1]


def test_one_noisy_velocity_or_position_do_not_restart_it() -> None:
    still = standstill()
    for step in range(60):
        velocity = (0.45, 0.0, 0.0) if step == 35 else (0.1, 0.0, 0.0)
        place = (0.05 if step == 45 else 0.0, 0.0, 5.0)
        assert still.holds(at(0.05 * step, place, velocity), STALE_S) is (step >= 20), step


@pytest.mark.parametrize("speed_m_s", [0.25, 0.3, 0.4, 1.0, 8.0])
def test_what_creeps_on_does_not_stand(speed_m_s: float) -> None:
    places = [(0.05 * step, (speed_m_s * 0.05 * step, 0.0, 5.0)) for step in range(80)]
    still = standstill()
    assert not any(seen(still, *(at(time_s, place) for time_s, place in places)))
    assert still.speed_m_s == pytest.approx(speed_m_s)


def test_what_sways_does_not_stand_though_its_mean_velocity_is_none() -> None:
    still = standstill()
    for step in range(400):
        phase = 0.05 * step * math.tau / 3.0  # 0.3 m to and fro in 3 s: up to 0.63 m/s
        assert not still.holds(at(0.05 * step, (0.3 * math.sin(phase), 0.0, 5.0)), STALE_S)


def test_a_position_that_is_frozen_while_the_velocity_is_not_is_no_stop() -> None:
    fast = [at(0.05 * step, (0.0, 0.0, 5.0), (3.0, 0.0, 0.0)) for step in range(60)]
    assert not any(seen(standstill(), *fast))


def test_a_position_that_is_only_repeated_or_old_says_nothing() -> None:
    still = standstill()
    first = at(0.0, (0.0, 0.0, 5.0))
    aged = [replace(first, time_s=0.1 * n, position_age_s=0.1 * n) for n in range(30)]
    assert not any(seen(still, first, *aged))
    assert still.speed_m_s is None
    assert "an unknown speed" in still.failure(10.0)


def test_a_px4_that_holds_has_stopped_although_its_velocity_says_otherwise() -> None:
    """Recorded: from 51 to 84 s after its start it holds, and says 0.2 to 0.7 m/s."""
    codec, still = Codec(1, 191), standstill()
    verdicts, slow = [], []
    for _, frame in TlogReader(PX4_HOLD):
        for message in codec.decode(frame):
            time_s = getattr(message, "time_boot_ms", 0) / 1e3
            if message.get_type() != "LOCAL_POSITION_NED" or not 52.0 <= time_s <= 84.0:
                continue
            velocity = (message.vy, message.vx, -message.vz)
            place = (message.y, message.x, -message.z)
            verdicts.append(still.holds(at(time_s, place, velocity), STALE_S))
            slow.append(math.hypot(*velocity) < 0.3)
    assert len(verdicts) > 100
    assert sum(slow) < 0.75 * len(slow), "by its velocity it moves"
    assert sum(verdicts) > 0.55 * len(verdicts)
    waits = "".join("#" if verdict else "." for verdict in verdicts).split("#")
    assert max(map(len, waits)) < 13, "at 5 Hz: never more than 2.5 s"


def test_a_copter_that_falls_back_after_a_climb_does_not_stand_where_it_turns() -> None:
    """Heights every 0.1 s, as explored: it overshoots, and falls back at up to 0.37 m/s."""
    heights_m = (
        (10.28, 10.41, 10.53, 10.64, 10.73, 10.82, 10.88, 10.94, 10.99, 11.02, 11.05, 11.06, 11.06),
        (11.05, 11.04, 11.01, 10.96, 10.92, 10.89, 10.85, 10.83, 10.81, 10.79, 10.78, 10.77, 10.77),
        (10.77, 10.78, 10.78, 10.78, 10.78),
    )
    places = [(0.0, 0.0, up_m) for row in heights_m for up_m in row]
    verdicts = seen(standstill(), *(at(0.1 * step, place) for step, place in enumerate(places)))
    assert verdicts.index(True) >= 22, "it has come down to 0.2 m/s"


def test_a_rover_that_rolls_back_does_not_stand_at_its_turning_point() -> None:
    """Place and velocity every 0.1 s, as explored; at the end it rolls at 0.36 m/s."""
    rolled = (
        (10.60, 0.89), (10.68, 0.77), (10.75, 0.64), (10.81, 0.51), (10.85, 0.38), (10.88, 0.25),
        (10.90, 0.12), (10.91, 0.01), (10.90, -0.10), (10.89, -0.19), (10.87, -0.26),
        (10.854, -0.34), (10.82, -0.36),
    )  # fmt: skip
    observations = [
        at(0.1 * step, (place_m, 0.0, 0.0), (velocity_m_s, 0.0, 0.0))
        for step, (place_m, velocity_m_s) in enumerate(rolled)
    ]
    config = GotoConfig(stop_speed_m_s=0.3, stop_dwell_s=1.0)
    assert not any(seen(Standstill.of_stop(config, Traits("rover", flies=False)), *observations))
