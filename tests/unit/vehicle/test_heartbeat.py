from __future__ import annotations

import pytest

from mavlink_vehicle.codec import mavlink
from mavlink_vehicle.events import HeartbeatLost, HeartbeatRegained
from mavlink_vehicle.protocols.monitoring.heartbeat import HeartbeatSender, HeartbeatWatch
from tests.support.messages.autopilot_messages import AutopilotMessages


def test_ours_goes_out_at_its_rate_as_an_onboard_computer() -> None:
    sender = HeartbeatSender(1.0, mavlink.MAV_TYPE_ONBOARD_CONTROLLER)
    sender.start(5.0)
    times = []
    now = 5.0
    while now < 15.0:
        for message in sender.messages_to_send():
            times.append(now)
            assert message.type == mavlink.MAV_TYPE_ONBOARD_CONTROLLER
            assert message.autopilot == mavlink.MAV_AUTOPILOT_INVALID
            assert message.base_mode == 0
            assert message.system_status == mavlink.MAV_STATE_ACTIVE
        deadline = sender.deadline_s
        assert deadline is not None
        now = deadline
        sender.handle_timer(now)
    assert times == pytest.approx([5.0 + n for n in range(10)])


def test_after_a_pause_only_one_goes_out() -> None:
    sender = HeartbeatSender(1.0, mavlink.MAV_TYPE_ONBOARD_CONTROLLER)
    sender.start(0.0)
    sender.messages_to_send()
    sender.handle_timer(7.3)
    sender.handle_timer(7.3)
    assert len(sender.messages_to_send()) == 1
    deadline = sender.deadline_s
    assert deadline is not None
    assert 7.5 < deadline <= 8.3


def test_theirs_is_lost_after_the_time_and_regained_with_the_next() -> None:
    beat = AutopilotMessages().heartbeat()
    watch = HeartbeatWatch(3.0)
    watch.start(0.0)
    watch.handle_timer(100.0)  # nobody was ever there: nothing is lost
    assert watch.next_event() is None
    assert not watch.alive
    watch.receive(beat, 100.0)
    watch.receive(beat, 101.0)
    watch.handle_timer(103.9)
    assert watch.alive
    watch.handle_timer(104.0)
    assert not watch.alive
    assert watch.next_event() == HeartbeatLost(3.0)
    watch.handle_timer(200.0)
    assert watch.next_event() is None
    watch.observe_boots(1)
    watch.receive(beat, 201.0)
    assert watch.alive
    assert watch.next_event() == HeartbeatRegained(rebooted=True)
    assert watch.next_event() is None


def test_lost_heartbeats_are_no_lost_link_while_other_messages_come() -> None:
    watch = HeartbeatWatch(3.0)
    watch.receive(AutopilotMessages().heartbeat(), 10.0)
    watch.heard_s = 12.5
    watch.handle_timer(13.0)
    assert watch.alive
    assert watch.deadline_s == 15.5
    watch.handle_timer(15.5)
    assert watch.next_event() == HeartbeatLost(5.5)


def test_other_messages_do_not_stand_in_for_heartbeats_for_good() -> None:
    watch = HeartbeatWatch(3.0)
    watch.receive(AutopilotMessages().heartbeat(), 10.0)
    for now in range(11, 30):
        watch.heard_s = float(now)
        watch.handle_timer(float(now))
    assert watch.next_event() == HeartbeatLost(9.0)
    assert not watch.alive
