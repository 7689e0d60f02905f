"""Each recording gives the same again and again: events, states and feedback as they are kept.

`pytest tests/replay/test_golden.py --update-golden` keeps what is found now; look at what
changes. Allowed differences are listed in `tests/support/logs/golden.py`.
"""

from __future__ import annotations

import functools
import json
from pathlib import Path
from typing import Any

import pytest
from pymavlink import mavutil

from mavlink_vehicle.codec import Codec
from mavlink_vehicle.io.tlog import TlogReader
from mavlink_vehicle.state.batteries import SILENT_S as BATTERY_SILENT_S
from mavlink_vehicle.state.reducer import VehicleState
from mavlink_vehicle.vehicle import Vehicle
from navigation_bridge.bridge import Bridge
from navigation_bridge.configuration.make_config import make_config
from navigation_bridge.recording.replay import play
from tests.support.flights.made_flights import FOLDER as MADE
from tests.support.flights.made_flights import RECIPES
from tests.support.logs.golden import (
    MAY_DIFFER,
    differences,
    golden_of,
    systems_of,
    write_golden,
)
from tests.support.logs.recordings import NAMES, SMALL, recording

pytestmark = pytest.mark.wide_but_first


ROOT = Path(__file__).resolve().parents[2]
GOLDEN = Path(__file__).parent / "golden"
OWN = {
    f"{folder}/{path.stem}": path
    for folder, place in (
        ("made", MADE),
        ("small", SMALL),
        ("data", ROOT / "tests/data"),
    )
    for path in sorted(place.glob("*.tlog"))
}
ARMED = 128  # MAV_MODE_FLAG_SAFETY_ARMED
EKF_POSITION = 0x10  # EKF_POS_HORIZ_ABS, ESTIMATOR_POS_HORIZ_ABS


def place_of(name: str) -> Path:
    return OWN[name] if name in OWN else recording(name)


@pytest.mark.parametrize("name", [*OWN, *NAMES])
def test_a_recording_gives_what_it_always_gave(name: str, request: pytest.FixtureRequest) -> None:
    found = json.loads(json.dumps(golden_of(place_of(name))))
    kept = GOLDEN / f"{name.replace('/', '_')}.json"
    if request.config.getoption("--update-golden"):
        write_golden(kept, found)
        return
    assert kept.exists(), f"{kept} is missing: run pytest with --update-golden"
    assert differences(json.loads(kept.read_text("utf-8")), found) == []


def test_nothing_may_differ_but_what_is_listed_with_a_reason() -> None:
    name, path = next(iter(OWN.items()))
    kept = json.loads((GOLDEN / f"{name.replace('/', '_')}.json").read_text("utf-8"))
    found = json.loads(json.dumps(golden_of(path)))
    for key in MAY_DIFFER:
        assert key in kept
        found[key] = -1
    assert differences(kept, found) == []
    found["vehicles"]["1"]["states"][3]["armed"] = "perhaps"
    assert differences(kept, found) != []


def test_every_recipe_has_its_recording_and_each_is_small() -> None:
    assert {path.stem for path in MADE.glob("*.tlog")} == set(RECIPES)
    assert all(path.stat().st_size < 65_000 for path in MADE.glob("*.tlog"))


def test_a_made_recording_is_made_again_the_same(tmp_path: Path) -> None:
    """So that they can be renewed without a change that nobody meant."""
    again = tmp_path / "again.tlog"
    RECIPES["station_cancel"].fly(again)
    assert again.read_bytes() == (MADE / "station_cancel.tlog").read_bytes()


@pytest.mark.parametrize("name", [*OWN, *NAMES])
def test_nothing_is_mistaken_for_a_state_that_it_was_not(name: str) -> None:
    """Armed, mode, position and battery, after each message, against the messages themselves."""
    path = place_of(name)
    for system in systems_of(path):
        raw = Raw(path, system)
        config = make_config({"target_system": system})
        bridge = Bridge(Vehicle(config.vehicle), config.bridge)
        checked = 0
        for played in play(TlogReader(path), bridge, Codec(1, 191)):
            message = played.message
            if message is None or message.get_type() not in Raw.KINDS:
                continue
            if (message.get_srcSystem(), message.get_srcComponent()) == (system, 1):
                if not raw.follow(message):
                    continue
                raw.check(bridge.vehicle)
                checked += 1
        assert checked > 100 * raw.lost


@functools.lru_cache(maxsize=1)
def as_pymavlink_reads(path: Path) -> dict[int, list[Any]]:
    """Return what each autopilot said, by system."""
    messages: dict[int, list[Any]] = {}
    log = mavutil.mavlink_connection(str(path), dialect="all")
    while (message := log.recv_match(type=list(Raw.KINDS))) is not None:
        if message.get_srcComponent() == 1:
            messages.setdefault(message.get_srcSystem(), []).append(message)
    log.close()
    return messages


class Raw:
    """The same recording as pymavlink's own reader reads it, message by message."""

    KINDS = (
        "HEARTBEAT", "GLOBAL_POSITION_INT", "EKF_STATUS_REPORT", "ESTIMATOR_STATUS",
        "BATTERY_STATUS", "SYS_STATUS", "CURRENT_MODE",
    )  # fmt: skip

    def __init__(self, path: Path, system: int) -> None:
        self._messages = list(reversed(as_pymavlink_reads(path)[system]))
        self._last: dict[str, Any] = {}
        self._mode: int | None = None
        self._now_s = 0.0
        self.lost = 0

    def follow(self, message: Any) -> bool:
        """Take what it has of the same message; False for one that it lost after damage."""
        found = self._messages[-1] if self._messages else None
        if found is None or found.get_msgbuf() != message.get_msgbuf():
            self.lost += 1
            self._last.pop(message.get_type(), None)
            return False
        self._messages.pop()
        kind, self._now_s = found.get_type(), found._timestamp
        if kind != "BATTERY_STATUS" or found.id == 0:
            self._last[kind] = found
        if kind in ("HEARTBEAT", "CURRENT_MODE"):
            self._mode = found.custom_mode
        return True

    def check(self, vehicle: Vehicle) -> None:
        state = vehicle.state
        beat = self._last.get("HEARTBEAT")
        if beat is not None and state.last_heartbeat_s is not None:
            assert state.armed == bool(beat.base_mode & ARMED)
            assert state.custom_mode == self._mode
            assert state.system_status == beat.system_status
        self._check_position(state)
        self._check_battery(state)

    def _check_position(self, state: VehicleState) -> None:
        if not state.position_valid:
            return
        place = self._last["GLOBAL_POSITION_INT"]
        assert (place.lat, place.lon) != (0, 0)
        estimator = self._last.get("EKF_STATUS_REPORT") or self._last.get("ESTIMATOR_STATUS")
        if estimator is not None:
            assert estimator.flags & EKF_POSITION

    def _check_battery(self, state: VehicleState) -> None:
        raw, summary = self._last.get("BATTERY_STATUS"), self._last.get("SYS_STATUS")
        ended = raw is not None and self._now_s - raw._timestamp > BATTERY_SILENT_S
        if summary is not None and (raw is None or ended):
            raw = summary
        if state.battery is None or raw is None:
            return
        left = raw.battery_remaining
        assert state.battery.remaining == (None if left < 0 else left / 100)
