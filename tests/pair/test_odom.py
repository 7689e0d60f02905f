"""REP 105 in flight: `odom` follows the vehicle and never its estimator's jumps."""

from __future__ import annotations

import math

import pytest

from mavlink_sitl import LinkFaults, VehicleConfig
from navigation_bridge.vehicle.odom_frame import OdomFrame, at_time_of_position
from tests.support.flights.simulated_flight import SimulatedFlight

pytestmark = pytest.mark.wide


GLITCH_M = 20.0


class FollowedFlight(SimulatedFlight):
    """A flight whose poses are followed as the server's topics follow them."""

    def __init__(self, autopilot: str, kind: str) -> None:
        self.frame = OdomFrame()
        self.steps_m: list[float] = []
        self._seen: object = None
        simulated = VehicleConfig(autopilot=autopilot, vehicle=kind, ready_after_s=1.0)
        super().__init__(simulated=simulated, battery_policy="ignore")

    def tick(self) -> None:
        super().tick()
        state, pose = self.vehicle.state, self.bridge.pose
        if pose is None or state.global_position is self._seen:
            return
        before = None if self._seen is None else self.frame.base_link[0]
        self._seen = state.global_position
        self.frame.follow(at_time_of_position(pose, state), state)
        if before is not None:
            self.steps_m.append(math.dist(before, self.frame.base_link[0]))


@pytest.mark.night
@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
@pytest.mark.parametrize("kind", ["copter", "rover"])
def test_a_jump_of_the_estimate_is_none_in_odom(autopilot: str, kind: str) -> None:
    flight = FollowedFlight(autopilot, kind)
    flight.ready()
    goal = flight.send(0.0, 60.0, 6.0 if kind == "copter" else 0.0, speed=3.0)
    flight.run_to_status(goal, "NAVIGATING")
    flight.run_for(4.0)
    assert flight.frame.in_map == ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0))
    flight.simulation.vehicles[0].shift_gps((GLITCH_M, 0.0, 0.0))
    flight.run_to_end(goal)
    assert flight.frame.in_map[0] == pytest.approx((0.0, GLITCH_M, 0.0), abs=1.0)
    assert flight.frame.in_map[1][0] > 0.999
    assert max(flight.steps_m) < 1.5


@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
@pytest.mark.parametrize("kind", ["copter", "rover"])
def test_on_a_bad_link_motion_is_no_jump(autopilot: str, kind: str) -> None:
    flight = FollowedFlight(autopilot, kind)
    flight.ready()
    flight.simulation.vehicles[0].link.set_faults(LinkFaults(loss=0.2, jitter_s=0.1))
    for north_m in (20.0, -5.0):
        height_m = 6.0 if kind == "copter" else 0.0
        end = flight.run_to_end(flight.send(10.0, north_m, height_m, speed=4.0))
        assert end.code.value == "SUCCESS", end.message
    assert flight.frame.in_map == ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0))
