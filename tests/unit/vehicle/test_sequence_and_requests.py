from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from mavlink_vehicle.protocols.known_vehicle import SequenceOrder
from mavlink_vehicle.protocols.operations.requested_changes import RequestedChanges

GUIDED, BRAKE, LOITER = 4, 17, 5


@given(st.lists(st.integers(1, 6), min_size=1, max_size=80), st.data())
def test_packets_are_put_into_the_order_of_sending(steps: list[int], data: st.DataObject) -> None:
    """Some are lost (steps above 1), neighbours change places, the number wraps."""
    sent = [sum(steps[: n + 1]) for n in range(len(steps))]
    arrived = list(sent)
    for at in data.draw(st.lists(st.integers(0, len(sent) - 1), max_size=20)):
        if at + 1 < len(arrived):
            arrived[at], arrived[at + 1] = arrived[at + 1], arrived[at]
    order = SequenceOrder()
    first = order.place(arrived[0] % 256, 0.0)
    places = [first] + [order.place(n % 256, 0.01 * i) for i, n in enumerate(arrived[1:], 1)]
    assert [place - first for place in places] == [number - arrived[0] for number in arrived]


def test_after_a_silence_any_number_is_new() -> None:
    order = SequenceOrder()
    before = order.place(200, 0.0)
    assert order.place(150, 0.5) < before  # late
    assert order.place(10, 5.0) > before  # the sender restarted


def test_each_request_allows_one_change_to_what_it_asked_for() -> None:
    requested = RequestedChanges(grace_s=5.0)
    assert not requested.take_mode(GUIDED, 0.0)
    requested.add(mode=GUIDED)
    assert not requested.take_mode(BRAKE, 1.0)
    assert not requested.take_armed(True, 1.0)
    assert requested.take_mode(GUIDED, 100.0)  # the operation still runs
    assert not requested.take_mode(GUIDED, 100.0)  # a pilot brought it back


def test_a_request_outlives_its_operation_for_the_grace_period() -> None:
    for late_s, expected in ((4.9, True), (5.1, False)):
        requested = RequestedChanges(grace_s=5.0)
        requested.add(armed=True)
        requested.end(10.0)
        requested.end(20.0)  # a later operation's end doesn't prolong it
        assert requested.take_armed(True, 10.0 + late_s) is expected


def test_contradictions_under_way_are_known() -> None:
    requested = RequestedChanges(grace_s=5.0)
    assert not requested.contradicted(0.0, mode=GUIDED, armed=None)
    requested.add(mode=BRAKE)
    assert requested.contradicted(0.0, mode=GUIDED, armed=None)
    assert not requested.contradicted(0.0, mode=BRAKE, armed=None)
    assert not requested.contradicted(0.0, mode=None, armed=True)
    requested.end(0.0)
    assert not requested.contradicted(6.0, mode=GUIDED, armed=None)
    requested.add(armed=False)
    assert requested.contradicted(6.0, mode=None, armed=True)
