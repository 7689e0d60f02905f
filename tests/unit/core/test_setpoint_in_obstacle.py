"""A setpoint that a brake has left in an obstacle is nothing to plan from."""

from __future__ import annotations

from dataclasses import replace

import pytest

from navigation_core.geometry import KinematicState
from navigation_core.mapping.obstacle_shapes import Box
from navigation_core.mapping.obstacles import Obstacles
from navigation_core.tasks.goto_config import GotoConfig
from navigation_core.tasks.leading.carrot import Commanded, SentSetpoint
from navigation_core.tasks.leading.flight_terms import FlightTerms
from tests.support.models.observations import HOVERING

# Only the face of a wall that is seen is known.
FACE = Obstacles.of((Box("face", (5.0, 0.0), (0.3, 40.0)),))


@pytest.mark.parametrize(
    ("vehicle_x_m", "setpoint_x_m", "begins_x_m"),
    [
        (4.6, 5.0, 4.6),
        (4.6, 5.3, 4.6),
        (3.0, 3.3, 3.3),  # beside nothing a lag is an autopilot's own matter
        (5.0, 4.7, 4.7),  # the setpoint leads the vehicle out
    ],
)
def test_a_path_begins_where_the_vehicle_is_if_its_setpoint_is_in_an_obstacle(
    vehicle_x_m: float, setpoint_x_m: float, begins_x_m: float
) -> None:
    observation = replace(HOVERING, position_enu_m=(vehicle_x_m, 0.0, 5.0), obstacles=FACE)
    commanded = Commanded(KinematicState((setpoint_x_m, 0.0, 5.0)), 0.0)
    sent = SentSetpoint(FlightTerms(GotoConfig()))
    start = sent.start_around(commanded, observation)
    assert start.position_enu_m[0] == pytest.approx(begins_x_m)
