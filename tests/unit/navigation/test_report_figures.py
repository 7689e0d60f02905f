"""Figures of a report: loss, commands, setpoints, events, the text of a log."""

from __future__ import annotations

import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from flight_logs.frames.records import Records
from flight_reports.analysis.link_quality import link_quality, missing_before
from flight_reports.analysis.tracking import tracking
from flight_reports.contents.track import TrackSamples
from flight_reports.page.figures import line
from flight_reports.page.html import safe

_PACKET = np.dtype([("time_s", "<f8"), ("sequence_number", "u1")])


def packets(numbers: list[int], period_s: float = 0.1) -> Records:
    made: Records = np.zeros(len(numbers), dtype=_PACKET)
    made["time_s"] = period_s * np.arange(len(numbers))
    made["sequence_number"] = np.array(numbers) % 256
    return made


@given(
    st.integers(0, 255),
    st.lists(st.booleans(), min_size=2, max_size=600).map(lambda kept: [True, *kept, True]),
)
def test_loss_by_sequence_numbers_matches_the_removed_packets(first: int, kept: list[bool]) -> None:
    numbers = [first + i for i, is_kept in enumerate(kept) if is_kept]
    if max(np.diff(numbers)) < 240:
        found = link_quality(packets(numbers), 100.0, 3.0)
        assert found.lost == kept.count(False)
        assert found.received == kept.count(True)


def test_reordered_packets_are_not_lost_and_duplicates_count_once() -> None:
    found = link_quality(packets([254, 255, 1, 0, 2, 2, 3]), 1.0, 3.0)
    assert (found.lost, found.repeated, found.received) == (0, 1, 6)
    assert missing_before(packets([254, 1, 0, 2])["sequence_number"]).tolist() == [0, 2, -1, 0]


def test_random_sequence_numbers_give_no_loss() -> None:
    assert not link_quality(packets([0, 100, 7, 190, 80, 201] * 20), 12.0, 3.0).numbers_follow


def test_sequence_numbers_reset_by_a_restart_are_not_a_loss() -> None:
    numbers = [*range(100, 150), *range(50)]
    assert link_quality(packets(numbers), 10.0, 3.0).lost > 100
    assert link_quality(packets(numbers), 10.0, 3.0, [5.5]).lost == 0


def test_a_silence_is_found_also_at_the_end() -> None:
    quiet = packets([0, 1, 2])
    quiet["time_s"] = (0.0, 1.0, 6.0)
    assert link_quality(quiet, 20.0, 3.0).gaps == ((1.0, 6.0), (6.0, 20.0))


def circle(time_s: np.ndarray[tuple[int], np.dtype[np.float64]]) -> TrackSamples:
    angle = 0.5 * time_s
    return TrackSamples(
        time_s, np.stack([5 * np.cos(angle), 5 * np.sin(angle), 0 * angle], axis=-1)
    )


def test_a_delayed_response_is_measured_with_its_delay() -> None:
    time_s = np.arange(0.0, 30.0, 0.05)
    wanted = circle(time_s)
    late = TrackSamples(time_s, circle(time_s - 0.4).vectors_ned + np.array([0.0, 0.0, 0.5]))
    found = tracking(wanted, late, "m")
    assert found is not None
    assert found.delay_s == pytest.approx(0.4, abs=0.02)
    # Along a circle of 5 m, at 2.5 m/s.
    assert found.horizontal_rms == pytest.approx(2.5 * 0.4, rel=0.02)
    assert found.vertical_rms == pytest.approx(0.5)
    # It is below its setpoints; NED.
    assert found.vertical.max() < 0.0


def test_the_approach_to_a_far_setpoint_is_excluded() -> None:
    time_s = np.arange(0.0, 20.0, 0.1)
    far = TrackSamples(time_s, np.tile([20.0, 0.0, -5.0], (len(time_s), 1)))
    north_m = np.minimum(2.0 * time_s, 20.2)
    came = TrackSamples(time_s, np.stack([north_m, 0 * time_s, 0 * time_s - 5.0], axis=-1))
    found = tracking(far, came, "m")
    assert found is not None
    assert found.horizontal_max <= 1.0
    assert found.left_out == pytest.approx(95, abs=2)
    # Setpoints that stand still show no delay.
    assert found.delay_s is None


def test_missing_data_is_not_compared() -> None:
    time_s = np.arange(0.0, 10.0, 0.1)
    wanted = circle(time_s)
    gap = (time_s < 2.0) | (time_s > 8.0)
    found = tracking(wanted, TrackSamples(time_s[gap], wanted.vectors_ned[gap]), "m/s")
    assert found is not None
    assert found.count == pytest.approx(40, abs=3)
    assert found.horizontal_max == pytest.approx(0.0, abs=1e-9)
    assert tracking(TrackSamples(time_s[:3], wanted.vectors_ned[:3]), wanted, "m") is None


def test_a_line_is_thinned_with_its_peaks_and_broken_at_gaps() -> None:
    time_s = np.concatenate([np.arange(0.0, 500.0, 0.01), np.arange(600.0, 610.0, 0.01)])
    values = np.zeros(len(time_s))
    values[12_345] = 7.0
    drawn = json.loads(json.dumps(line(time_s, values, "it", "@track")))
    assert len(drawn["x"]) < 5000
    assert max(value for value in drawn["y"] if value is not None) == 7.0
    assert drawn["y"].count(None) == 1


@given(st.text())
def test_text_is_shown_and_never_markup(text: str) -> None:
    shown = safe(text)
    assert not set("<>\"'") & set(shown)
    assert safe(shown) == shown
