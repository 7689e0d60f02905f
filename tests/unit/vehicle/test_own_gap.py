from __future__ import annotations

import pytest

from mavlink_vehicle.protocols.monitoring.own_gap import OwnGap
from mavlink_vehicle.protocols.operations.command import Address

ADDRESS = Address(255, 191, 1, 1)


def gap_after(stalled_s: float) -> tuple[OwnGap, float]:
    """Run for two seconds, stand still, and run again; the vehicle's clock is 100 s ahead."""
    gap, now = OwnGap(lambda: ADDRESS), 0.0
    for tick in range(40):
        now = 0.05 * tick
        assert gap.notice(now, boot_ms(now), 1.0) is None
    now += stalled_s
    assert gap.notice(now, boot_ms(now - stalled_s), 1.0) == pytest.approx(stalled_s)
    assert gap.is_open
    return gap, now


def boot_ms(time_s: float) -> int:
    return round(1e3 * time_s) + 100_000


def test_as_long_as_we_run_there_is_no_gap() -> None:
    gap = OwnGap(lambda: ADDRESS)
    for tick in range(100):
        assert gap.notice(0.9 * tick, None, 1.0) is None
        gap.see_mode(0.9 * tick, None)
    assert not gap.is_open


@pytest.mark.parametrize("sent_s", [-2.5, -1.0, -0.1, 0.05])
@pytest.mark.parametrize("read_s", [0.01, 0.3, 1.4])
def test_what_waited_in_a_buffer_does_not_show_the_mode(sent_s: float, read_s: float) -> None:
    gap, now = gap_after(2.6)
    gap.notice(now + read_s, boot_ms(now + sent_s), 1.0)
    gap.see_mode(now + read_s, boot_ms(now + sent_s))
    assert gap.is_open


def test_a_heartbeat_of_now_shows_it() -> None:
    gap, now = gap_after(2.6)
    gap.see_mode(now + 0.2, boot_ms(now + 0.15))
    assert not gap.is_open


def test_a_second_gap_before_the_mode_was_seen_changes_nothing() -> None:
    gap, now = gap_after(2.6)
    assert gap.notice(now + 3.0, boot_ms(now - 2.0), 1.0) == pytest.approx(3.0)
    gap.see_mode(now + 3.0, boot_ms(now - 2.0))
    # The time alone would do by now, as nobody's buffer is read so late.
    assert not gap.is_open


def test_without_a_clock_of_the_vehicle_the_time_decides() -> None:
    gap = OwnGap(lambda: ADDRESS)
    gap.notice(0.0, None, 1.0)
    assert gap.notice(5.0, None, 1.0) == 5.0
    gap.see_mode(5.1, None)
    assert gap.is_open
    gap.see_mode(6.6, None)
    assert not gap.is_open


def test_a_restarted_vehicle_reports_its_mode_again() -> None:
    gap, now = gap_after(2.6)
    gap.see_mode(now + 0.1, 4_000)
    assert not gap.is_open


def test_the_mode_is_asked_for_until_it_is_seen() -> None:
    gap, now = gap_after(2.6)
    due = gap.deadline_s
    assert due is not None
    gap.handle_timer(now)
    assert not gap.messages_to_send()
    asked = 0
    while now < due + 0.5:
        now += 0.01
        gap.notice(now, boot_ms(now), 1.0)
        gap.handle_timer(now)
        asked += len(gap.messages_to_send())
    assert asked == 2
    gap.see_mode(now, boot_ms(now))
    assert gap.deadline_s is None
    gap.handle_timer(now + 1.0)
    assert not gap.messages_to_send()
