"""What `make demo` does, and what it leaves."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import pytest

from drone_navigation import notes
from drone_navigation.flight_recording import read_recording
from drone_navigation.processes import Process
from mavlink_vehicle.codec import Codec
from mavlink_vehicle.io.tlog import TlogReader

pytestmark = pytest.mark.xdist_group("ros_demo")


def test_the_demo_flies_records_and_draws(tmp_path: Path) -> None:
    out = tmp_path / "demo"
    demo = Process("demo", ["python", "-m", "drone_navigation.demo", "--out", str(out)])
    try:
        assert demo.wait(58.0) == 0, demo.text
    finally:
        demo.stop()
    assert "SUCCESS: " in demo.text
    assert (out / "flight.png").read_bytes().startswith(b"\x89PNG")

    codec = Codec(source_system=255, source_component=190)
    seen: Counter[tuple[str, int]] = Counter()
    for _, packet in TlogReader(out / "flight.tlog"):
        for message in codec.decode(packet):
            seen[(message.get_type(), message.get_srcComponent())] += 1
    assert seen[("GLOBAL_POSITION_INT", 1)] > 100  # from the vehicle
    assert seen[("SET_POSITION_TARGET_LOCAL_NED", 191)] > 50  # to it
    assert seen[("STATUSTEXT", notes.COMPONENT_ID)] > 3  # what ROS saw

    flight = read_recording(out / "flight.tlog")
    assert [goal.targets_enu_m for goal in flight.goals.values] == [((10.0, 5.0, 2.0),)]
    assert flight.status.values[-1] == "ended SUCCESS"
    assert flight.distance_m.values[0] > 10.0
    assert flight.distance_m.values[-1] < 0.5
    assert len(flight.battery_percent)
    assert not flight.remarks
