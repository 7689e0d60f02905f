"""Restarts of the autopilot, and what looks like one."""

from __future__ import annotations

import math

import pytest

from mavlink_vehicle.codec import Message
from mavlink_vehicle.state.reducer import VehicleState, reduce
from tests.support.messages.autopilot_messages import AutopilotMessages

KINDS = ("GLOBAL_POSITION_INT", "LOCAL_POSITION_NED", "ATTITUDE", "SYSTEM_TIME")
UPTIMES_S = [20.0, 4_000_000.0]
DAYS_S = 2**32 * 1e-3


class Telemetry:
    """A vehicle that sends each kind of message ten times a second, and HEARTBEAT."""

    def __init__(self, uptime_s: float, armed: bool = True, kinds: tuple[str, ...] = KINDS) -> None:
        self.make = AutopilotMessages()
        self.state = VehicleState()
        self.now, self.booted_s = 1000.0, 1000.0 - uptime_s
        self.armed, self.mode, self.status = armed, 4, 4
        self.kinds = kinds
        self.other_clock: dict[str, float] = {}
        self.restarted_at_s = math.nan
        self.restart_heartbeats = True
        self.take(self.beat())
        self.run(2.0)

    def beat(self) -> Message:
        return self.make.heartbeat(mode=self.mode, armed=self.armed, status=self.status)

    def take(self, message: Message) -> None:
        count = self.state.boot_count
        self.state = reduce(self.state, message, self.now)
        if self.state.boot_count != count:
            self.restarted_at_s = self.now

    def send(self, kind: str, time_boot_s: float | None = None) -> None:
        began_s = self.other_clock.get(kind, self.booted_s)
        fields = {"lat": 473977420, "lon": 85455940} if kind == "GLOBAL_POSITION_INT" else {}
        if time_boot_s is None:
            time_boot_s = 0.0 if math.isinf(began_s) else self.now - began_s
        time_boot_ms = round(1e3 * time_boot_s) % 2**32
        self.take(self.make(kind, time_boot_ms=time_boot_ms, **fields))

    def run(self, seconds: float) -> None:
        for step in range(round(10 * seconds)):
            self.now += 0.1
            if self.restart_heartbeats and step % 10 == 9:
                self.take(self.beat())
            for kind in self.kinds:
                self.send(kind)

    def restart(self, silence_s: float) -> None:
        self.now += silence_s
        self.booted_s = self.now - min(silence_s, 3.0)
        self.armed, self.mode, self.status = False, 0, 3


@pytest.mark.parametrize("uptime_s", UPTIMES_S)
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("time_boot_s", [0.0, 1.5, 9.0, 2_000_000.0])
def test_one_message_of_another_clock_is_no_restart(
    uptime_s: float, kind: str, time_boot_s: float
) -> None:
    vehicle = Telemetry(uptime_s)
    for _ in range(3):
        vehicle.send(kind, time_boot_s)
        vehicle.run(1.3)
    assert vehicle.state.boot_count == 0
    assert vehicle.state.boot_time_ms == pytest.approx(1e3 * (vehicle.now - vehicle.booted_s), 1)
    assert vehicle.state.global_position is not None
    assert vehicle.state.global_position.time_s == vehicle.now


@pytest.mark.parametrize("uptime_s", UPTIMES_S)
@pytest.mark.parametrize("offset_s", [math.inf, 0.0, -500.0, -5_000_000.0])
@pytest.mark.parametrize("kinds", [KINDS[:1], KINDS[2:3], KINDS[3:], KINDS[1:3]])
def test_kinds_of_messages_with_a_clock_of_their_own_are_no_restart(
    uptime_s: float, offset_s: float, kinds: tuple[str, ...]
) -> None:
    """Also when it is disarmed, and when nothing comes for a moment."""
    vehicle = Telemetry(uptime_s)
    began_s = offset_s if math.isinf(offset_s) else vehicle.now + offset_s
    vehicle.other_clock = dict.fromkeys(kinds, began_s)
    vehicle.run(5.0)
    vehicle.armed = False
    vehicle.run(5.0)
    vehicle.now += 1.5
    vehicle.run(6.0)
    assert vehicle.state.boot_count == 0
    for part in (vehicle.state.global_position, vehicle.state.attitude):
        assert part is not None
        assert part.time_s == vehicle.now


@pytest.mark.parametrize("uptime_s", UPTIMES_S)
@pytest.mark.parametrize("armed", [False, True])
@pytest.mark.parametrize("silence_s", [0.05, 0.5, 4.0])
@pytest.mark.parametrize("kinds", [KINDS, KINDS[2:3], KINDS[:2]])
def test_a_restart_is_noticed_within_a_second(
    uptime_s: float, armed: bool, silence_s: float, kinds: tuple[str, ...]
) -> None:
    """A PX4 announces none; here its HEARTBEAT comes last."""
    vehicle = Telemetry(uptime_s, armed, kinds)
    vehicle.restart_heartbeats = False
    vehicle.restart(silence_s)
    began_s = vehicle.now
    vehicle.run(1.2)
    assert vehicle.state.boot_count == 1
    assert vehicle.restarted_at_s - began_s <= (0.31 if silence_s >= 1.0 else 1.2)
    vehicle.restart_heartbeats = True
    vehicle.run(8.0)
    assert vehicle.state.boot_count == 1


@pytest.mark.parametrize("armed", [False, True])
def test_a_restart_is_noticed_at_once_when_it_shows_that_it_was_disarmed(armed: bool) -> None:
    vehicle = Telemetry(300.0, armed)
    vehicle.restart(0.2)
    vehicle.now += 0.1
    for kind in KINDS[:2]:
        vehicle.send(kind)
    assert vehicle.state.boot_count == 0
    vehicle.take(vehicle.beat())
    assert vehicle.state.boot_count == int(armed)
    vehicle.run(2.0)
    assert vehicle.state.boot_count == 1


@pytest.mark.parametrize("armed", [False, True])
@pytest.mark.parametrize("telemetry_s", [0.0, 1.0, 4.0, 30.0])
def test_an_announced_restart_counts_once(armed: bool, telemetry_s: float) -> None:
    """An ArduCopter sends two HEARTBEATs with MAV_STATE_BOOT at once, and two a second later."""
    vehicle = Telemetry(300.0, armed)
    vehicle.mode = 0
    vehicle.run(1.0)
    vehicle.restart(1.2)
    vehicle.status = 1
    for wait_s in (0.02, 1.0, 0.03):
        vehicle.take(vehicle.beat())
        vehicle.now += wait_s
    assert vehicle.state.boot_count == 1
    assert vehicle.state.global_position is None
    vehicle.status = 3
    vehicle.now += telemetry_s
    vehicle.run(5.0)
    assert vehicle.state.boot_count == 1
    assert vehicle.state.global_position is not None


@pytest.mark.parametrize("uptime_s", [2.5, 300.0])
def test_a_restart_soon_after_the_start_is_noticed_by_its_heartbeat(uptime_s: float) -> None:
    """Its clock goes back by less than a late packet may."""
    vehicle = Telemetry(uptime_s, armed=False)
    vehicle.mode = 0
    vehicle.take(vehicle.beat())
    vehicle.run(0.2)
    vehicle.restart(1.2)
    vehicle.status = 1
    vehicle.take(vehicle.beat())
    assert vehicle.state.boot_count == 1
    vehicle.status = 3
    vehicle.run(5.0)
    assert vehicle.state.boot_count == 1


def test_one_heartbeat_that_says_boot_is_no_restart() -> None:
    vehicle = Telemetry(300.0)
    vehicle.take(vehicle.make.heartbeat(mode=vehicle.mode, armed=True, status=1))
    vehicle.run(30.0)
    assert vehicle.state.boot_count == 0


def test_a_disarming_and_another_mode_are_no_restart() -> None:
    vehicle = Telemetry(300.0)
    vehicle.armed, vehicle.mode = False, 0
    vehicle.run(5.0)
    assert vehicle.state.boot_count == 0


@pytest.mark.parametrize("silence_s", [0.0, 5.0, 200.0])
def test_the_end_of_the_millisecond_counter_is_no_restart(silence_s: float) -> None:
    vehicle = Telemetry(DAYS_S - 3.0 - 0.5 * silence_s)
    vehicle.now += silence_s
    vehicle.run(10.0)
    assert vehicle.state.boot_count == 0
    assert vehicle.state.boot_time_ms is not None
    assert vehicle.state.boot_time_ms > 2**32
    vehicle.restart(2.0)
    vehicle.run(2.0)
    assert vehicle.state.boot_count == 1
    assert vehicle.state.boot_time_ms < 20_000


@pytest.mark.parametrize("speed", [0.1, 1.0, 10.0, 20.0])
def test_a_simulated_clock_may_be_slow_or_fast(speed: float) -> None:
    vehicle = Telemetry(300.0)
    uptime_s = vehicle.now - vehicle.booted_s
    for silence_s in (0.1, 0.1, 3.0, 0.1, 20.0, 0.1):
        vehicle.now += silence_s
        uptime_s += silence_s * speed
        for kind in KINDS:
            vehicle.send(kind, uptime_s)
        assert vehicle.state.boot_time_ms == pytest.approx(1e3 * uptime_s, abs=1)
    assert vehicle.state.boot_count == 0


def test_a_clock_that_is_set_is_no_restart() -> None:
    """A clock older than the time out of sight did not begin there."""
    vehicle = Telemetry(4000.0)
    vehicle.booted_s += 3000.0
    vehicle.run(5.0)
    vehicle.booted_s -= 2000.0
    vehicle.run(5.0)
    assert vehicle.state.boot_count == 0
    assert vehicle.state.boot_time_ms == pytest.approx(1e3 * (vehicle.now - vehicle.booted_s), 1)
