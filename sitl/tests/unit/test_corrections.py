"""RTCM corrections that a PX4 1.18 puts together from GPS_RTCM_DATA."""

from __future__ import annotations

from pymavlink.dialects.v20 import all as dialect

from mavlink_sitl.mavlink.corrections import AssembledPx4Corrections, Px4Corrections

_FULL = bytes(180)


def fragment(sequence: int, place: int, data: bytes) -> dialect.MAVLink_gps_rtcm_data_message:
    padded = list(data) + [0] * (180 - len(data))
    flags = sequence << 3 | place << 1 | 1
    return dialect.MAVLink_gps_rtcm_data_message(flags, len(data), padded)


def test_fragments_out_of_order_make_one_message() -> None:
    assembled, old = AssembledPx4Corrections(), Px4Corrections()
    for place, data in ((1, b"end"), (0, _FULL)):
        assembled.take(fragment(3, place, data))
        old.take(fragment(3, place, data))
    assert list(assembled.given) == [_FULL + b"end"]
    assert list(old.given) == [b"end", _FULL]


def test_full_fragments_without_an_empty_one_end_with_the_next_sequence() -> None:
    corrections = AssembledPx4Corrections()
    for place in (0, 1):
        corrections.take(fragment(3, place, _FULL))
    assert not corrections.given
    corrections.take(fragment(4, 0, b"next"))
    assert list(corrections.given) == [_FULL + _FULL, b"next"]


def test_what_has_a_gap_is_dropped() -> None:
    corrections = AssembledPx4Corrections()
    corrections.take(fragment(3, 1, _FULL))
    corrections.take(fragment(4, 0, b"next"))
    assert list(corrections.given) == [b"next"]
