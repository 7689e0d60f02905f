"""The limits of setpoints: what they may be while they are late, and when none may follow."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from navigation_core.geometry import ZERO, KinematicState, norm
from navigation_core.limits import Limits
from navigation_core.mapping.moving_obstacles import Moving
from navigation_core.mapping.obstacle_shapes import Cylinder
from navigation_core.mapping.obstacles import NOTHING, Obstacles
from navigation_core.safety.late_setpoints import Following
from navigation_core.tasks.goto_config import GotoConfig
from navigation_core.tasks.intents import Setpoint
from navigation_core.tasks.leading.carrot import Carrot
from navigation_core.tasks.leading.flight_terms import AvoidanceConfig
from navigation_core.tasks.leading.run_out_limiter import RunOutLimiter
from navigation_core.tasks.observation import Observation
from navigation_core.tasks.traits import Traits
from navigation_core.trajectories.trajectory import plan_to
from tests.support.models.observations import HOVERING

LIMITS = Limits()
AVOIDANCE = AvoidanceConfig()
COPTER = Traits(setpoint_timeout_s=3.0, following=Following())
HERE, GOAL = (0.0, 0.0, 5.0), (20.0, 0.0, 5.0)
NEAR = Obstacles.of((Cylinder("digger", (-1.5, 0.0), 0.5),))
FAR = Obstacles.of((Cylinder("mast", (-9.0, 0.0), 0.5),))


def observed(
    late_s: float, obstacles: Obstacles = NOTHING, moving: tuple[Moving, ...] = ()
) -> Observation:
    return replace(HOVERING, position_enu_m=HERE, obstacles=obstacles, moving=moving, late_s=late_s)


def limiter() -> RunOutLimiter:
    return RunOutLimiter(AVOIDANCE, COPTER, LIMITS)


def share(late_s: float, obstacles: Obstacles) -> float:
    trajectory = plan_to(KinematicState(HERE), GOAL, LIMITS)
    carrot = Carrot(trajectory, GotoConfig(), 0.0, 0.0, time_s=0.1)
    return limiter().speed_share(carrot, observed(late_s, obstacles))


@pytest.mark.parametrize("late_s", [1.0, 1.9])
def test_who_is_too_late_stands_still(late_s: float) -> None:
    assert share(late_s, NOTHING) == 0.0
    assert share(late_s, FAR) == 0.0


@pytest.mark.parametrize("late_s", [0.9, 1.0, 1.9])
def test_who_is_late_gives_way_to_what_comes_near(late_s: float) -> None:
    assert share(late_s, NEAR) == 1.0


def test_who_is_late_gives_way_without_an_acceleration() -> None:
    leaving = Setpoint((0.5, 0.0, 5.0), (0.8, 0.0, 0.0), (0.5, 0.0, 0.0), 0.0)
    sent = limiter().limited(leaving, observed(1.9, NEAR))
    assert sent.velocity_enu_m_s == leaving.velocity_enu_m_s
    assert norm(sent.acceleration_enu_m_s2) == 0.0


@pytest.mark.parametrize("avoidance", [AVOIDANCE, None])
@pytest.mark.parametrize("obstacles", [NOTHING, FAR])
def test_a_brake_that_nobody_ends_leads_to_a_standstill(
    obstacles: Obstacles, avoidance: AvoidanceConfig | None
) -> None:
    braking = Setpoint((0.0, 0.0, 5.0), (0.9, 0.0, 0.0), (-2.0, 0.0, 0.0), 0.0)
    leaving = Moving(np.array([(0.0, 9.0, 5.0)]), 0.0, (0.0, 1.0))
    careful = RunOutLimiter(avoidance, COPTER, LIMITS)
    sent = careful.limited(braking, observed(0.0, obstacles, (leaving,)))
    end_m_s = sent.velocity_enu_m_s[0] + sent.acceleration_enu_m_s2[0] * COPTER.setpoint_timeout_s
    assert end_m_s == pytest.approx(0.0, abs=1e-9)
    # The rest of the brake is in the position.
    assert sent.position_enu_m[0] < -0.05


def test_what_will_cross_the_run_out_makes_a_setpoint_slower() -> None:
    setpoint = Setpoint((0.0, 0.0, 5.0), (2.0, 0.0, 0.0), ZERO, 0.0)
    crossing = Moving(np.array([(5.0, -3.0, 5.0)]), 0.0, (0.0, 1.0))
    assert limiter().limited(setpoint, observed(0.0)).velocity_enu_m_s == (2.0, 0.0, 0.0)
    sent = limiter().limited(setpoint, observed(0.0, moving=(crossing,)))
    assert norm(sent.velocity_enu_m_s) < 1.7
