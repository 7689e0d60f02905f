"""`make demo` and `make demo-rover` fly, and leave their files."""

from __future__ import annotations

import math
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from drone_navigation.demo import SCENARIOS
from flight_reports.flight_recording import read_recording
from flight_reports.pictures.scene import replan_times_s
from mavlink_sitl import Shapes, load_world
from mavlink_vehicle.codec import Codec
from mavlink_vehicle.io.tlog import TlogReader
from navigation_bridge import notes
from tests.support.processes import STARVED, Process

pytestmark = pytest.mark.wide


RADIUS_M = 0.5  # vehicle_radius_m
ESTIMATE_OFF_M = 0.2  # the vehicle's place is its own estimate
_TRIES = 3
"""An obstacle that moves drives into a vehicle whose server gets no processor for seconds."""


def true_clearance_m(log: Path, world: Path) -> float:
    """Return how near a recorded flight came to the obstacles of its world, as they truly were."""
    shapes = Shapes(load_world(world).obstacles)
    codec = Codec(source_system=255, source_component=190)
    nearest_m = math.inf
    for _, packet in TlogReader(log):
        for message in codec.decode(packet):
            if message.get_type() == "LOCAL_POSITION_NED":
                shapes.move_to(message.time_boot_ms * 1e-3)
                place = np.array([[message.x, message.y, message.z]])
                apart = np.hypot(shapes.gaps(place), shapes.heights_apart(place[:, 2]))
                nearest_m = min(nearest_m, float(apart.min()))
    return nearest_m


@pytest.mark.night_but_first
@pytest.mark.parametrize(
    ("vehicle", "goal_enu_m"),
    [
        pytest.param("copter", (0.0, 0.0, 4.0), marks=pytest.mark.xdist_group("demo_copter")),
        pytest.param("rover", (0.0, 0.0, 0.0), marks=pytest.mark.xdist_group("demo_rover")),
    ],
)
def test_the_demo_goes_round_what_the_server_does_not_know_and_shows_it(
    tmp_path: Path, vehicle: str, goal_enu_m: tuple[float, float, float]
) -> None:
    out = tmp_path / "demo"
    words = ["python", "-m", "drone_navigation.demo", "--vehicle", vehicle, "--out", str(out)]
    for _ in range(_TRIES):
        demo = Process("demo", words)
        try:
            code = demo.wait(190.0)
        finally:
            demo.stop()
        log = (out / "navigation_server.log").read_text(encoding="utf-8")
        if code == 0 or not any(told in log for told in STARVED):
            break
    assert code == 0, demo.text
    assert "SUCCESS: " in demo.text
    assert "Flown: 3 waypoints and 1 goal sent in flight" in demo.text
    assert demo.lines[0].startswith("The demo takes about ")
    assert demo.lines[-1].startswith("Next: make console ")
    assert ("on the ground with its motors off" in demo.text) == (vehicle == "copter")
    assert (out / "flight.png").read_bytes().startswith(b"\x89PNG")

    flight = read_recording(out / "flight.tlog")
    route, update = flight.goals.values
    assert len(route.targets_enu_m) == 3
    assert update.targets_enu_m[0] == pytest.approx(goal_enu_m, abs=0.1)
    assert len(replan_times_s(flight)) >= 2
    assert len(flight.plans) >= 3
    assert any(len(obstacles) > 20 for obstacles in flight.obstacles.values)
    assert "ended SUCCESS" in flight.status.values
    assert flight.distance_m.values[0] > 50.0
    assert flight.distance_m.values[-1] < 1.0
    assert len(flight.battery_percent)
    assert not flight.remarks
    clearance_m = true_clearance_m(out / "flight.tlog", SCENARIOS[vehicle].world)
    assert clearance_m > RADIUS_M - ESTIMATE_OFF_M, clearance_m

    codec = Codec(source_system=255, source_component=190)
    seen: Counter[tuple[str, int]] = Counter()
    for _, packet in TlogReader(out / "flight.tlog"):
        for message in codec.decode(packet):
            seen[(message.get_type(), message.get_srcComponent())] += 1
    assert seen[("OBSTACLE_DISTANCE", 1)] > 100  # from the vehicle
    assert seen[("SET_POSITION_TARGET_LOCAL_NED", 191)] > 50  # to it
    assert seen[("STATUSTEXT", notes.COMPONENT_ID)] > 3  # what ROS saw
