"""Reports of one vehicle that cannot all be its own."""

from __future__ import annotations

import itertools

import pytest

from mavlink_vehicle.codec import Message, mavlink
from mavlink_vehicle.state.position_trust import PositionTrust
from mavlink_vehicle.state.reducer import VehicleState, reduce
from tests.support.messages.autopilot_messages import AutopilotMessages

HOME = {"latitude": 473977420, "longitude": 85455940, "altitude": 488000}


class Heard:
    """A vehicle that is armed in the air, and somebody who speaks with its ids."""

    def __init__(self) -> None:
        self.own, self.liar = AutopilotMessages(), AutopilotMessages()
        self.trust = PositionTrust()
        self.state = VehicleState()
        self.now = 100.0
        self.take(self.own.heartbeat(armed=True, status=4))
        self.take(self.own("EXTENDED_SYS_STATE", landed_state=mavlink.MAV_LANDED_STATE_IN_AIR))

    def take(self, message: Message) -> None:
        before = self.state
        self.state = reduce(before, message, self.now)
        self.trust.observe(before, self.state, self.now)

    def both(
        self, true: Message, lie: Message, period_s: float, lies_s: float, for_s: float
    ) -> None:
        """Hear the vehicle's message and the lie, each with its own period, for a while."""
        events = [(period_s * i, true) for i in range(round(for_s / period_s))]
        events += [(lies_s * i + 0.31, lie) for i in range(round(for_s / lies_s))]
        begun_s = self.now
        for after_s, message in sorted(events, key=lambda event: event[0]):
            self.now = begun_s + after_s
            self.take(message)
        self.now = begun_s + for_s


def reports(heard: Heard) -> dict[str, tuple[float, Message, Message]]:
    """Return, by what contradicts, the period and a true report with its lie."""
    own, liar = heard.own, heard.liar
    return {
        "armed and disarmed": (
            1.0, own.heartbeat(armed=True, status=4), liar.heartbeat(armed=False),
        ),
        "on the ground and in the air": (
            0.5,
            own("EXTENDED_SYS_STATE", landed_state=mavlink.MAV_LANDED_STATE_IN_AIR),
            liar("EXTENDED_SYS_STATE", landed_state=mavlink.MAV_LANDED_STATE_ON_GROUND),
        ),
        "with a GPS fix and without one": (
            0.5, own("GPS_RAW_INT", fix_type=3), liar("GPS_RAW_INT", fix_type=1),
        ),
        "with two charges of its battery": (
            0.5,
            own("BATTERY_STATUS", battery_remaining=30),
            liar("BATTERY_STATUS", battery_remaining=99),
        ),
        "with two homes": (
            1.0,
            own("HOME_POSITION", **HOME),
            liar("HOME_POSITION", **{**HOME, "latitude": HOME["latitude"] + 3000}),
        ),
    }  # fmt: skip


KINDS = tuple(reports(Heard()))


@pytest.mark.parametrize(("kind", "lies_s"), tuple(itertools.product(KINDS, (0.05, 0.4, 1.1, 5.0))))
def test_a_stream_beside_the_true_one_is_found(kind: str, lies_s: float) -> None:
    heard = Heard()
    period_s, true, lie = reports(heard)[kind]
    heard.both(true, lie, period_s, lies_s, 20.0)
    assert heard.trust.fault is not None
    assert heard.trust.fault.is_contradiction
    assert kind in heard.trust.fault.reason


@pytest.mark.parametrize("kind", KINDS)
def test_a_contradiction_is_over_some_time_after_the_last_lie(kind: str) -> None:
    heard = Heard()
    period_s, true, lie = reports(heard)[kind]
    heard.both(true, lie, period_s, 0.4, 5.0)
    assert heard.trust.complaint
    for _ in range(40):
        heard.now += 0.5
        heard.take(true)
        heard.take(heard.own.heartbeat(armed=True, status=4))
    assert not heard.trust.complaint


@pytest.mark.parametrize("kind", KINDS)
def test_one_change_and_its_return_are_none(kind: str) -> None:
    """A pilot who arms and disarms, a fix that is lost for a moment, a home that is set twice."""
    heard = Heard()
    _, true, other = reports(heard)[kind]
    for message in (true, other, true, other, other, true):
        heard.take(message)
        heard.now += 1.4
    assert "contradict" not in heard.trust.complaint


def test_a_position_that_goes_to_and_fro_is_in_doubt_wherever_it_is_just_now() -> None:
    heard = Heard()
    for step in range(60):
        heard.now += 0.1
        off = 5000 if step % 3 == 2 else 0
        heard.take(
            heard.own("GLOBAL_POSITION_INT", time_boot_ms=round(1e3 * heard.now),
                      lat=473977420 + off, lon=85455940)
        )  # fmt: skip
        if step > 20:
            assert heard.trust.fault is not None
            assert "at two positions" in heard.trust.fault.reason
