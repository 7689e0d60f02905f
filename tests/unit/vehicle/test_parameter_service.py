"""The parameter service by itself: lists that change, errors, old answers, odd types."""

from __future__ import annotations

import math
import struct

import pytest

from mavlink_vehicle.codec import Message, mavlink
from mavlink_vehicle.events import (
    OperationResult,
    Parameter,
    ParameterChange,
    ParametersFinished,
)
from mavlink_vehicle.protocols.operations.command import Address
from mavlink_vehicle.storage.changes import ParameterChanges
from mavlink_vehicle.storage.listing import ParameterListing
from mavlink_vehicle.storage.one_parameter import OneParameter
from mavlink_vehicle.storage.values import (
    as_float32,
    encode_value,
    same_value,
    value_problem,
)
from tests.support.messages.autopilot_messages import AutopilotMessages

ADDRESS = Address(1, 191, 1, 1)
INT8, INT32, REAL32 = 2, 6, 9
say = AutopilotMessages()


def value(name: str, number: float, index: int = 65535, count: int = 3, kind: int = 9) -> Message:
    return say(
        "PARAM_VALUE", param_id=name, param_value=number, param_type=kind, param_index=index,
        param_count=count,
    )  # fmt: skip


def error(name: str, number: int, component: int = 191) -> Message:
    return say(
        "PARAM_ERROR", param_id=name, param_index=-1, error=number, target_system=1,
        target_component=component,
    )  # fmt: skip


class Conversation:
    """A job, what it has asked, and its end."""

    def __init__(self, job: ParameterListing | ParameterChanges) -> None:
        self.job = job
        self.now = 0.0
        job.start(0.0)

    def asked(self) -> list[str]:
        return [
            f"{m.get_type()} {getattr(m, 'param_index', '')} {getattr(m, 'param_id', '')}".strip()
            for m in self.job.messages_to_send()
        ]

    def tell(self, *messages: Message) -> None:
        for message in messages:
            self.job.receive(message, self.now)

    def wait(self) -> None:
        deadline = self.job.deadline_s
        assert deadline is not None
        self.now = deadline
        self.job.handle_timer(deadline)

    def end(self) -> ParametersFinished:
        end = self.job.next_event()
        assert end is not None
        assert self.job.deadline_s is None
        return end


# --- the list ------------------------------------------------------------------------------


def test_what_was_lost_is_asked_for_by_its_index() -> None:
    talk = Conversation(ParameterListing(ADDRESS, bytewise=False))
    assert talk.asked() == ["PARAM_REQUEST_LIST"]
    talk.tell(value("A", 1.0, 0), value("C", 3.0, 2))
    talk.wait()
    assert talk.asked() == ["PARAM_REQUEST_READ 1"]
    talk.wait()
    assert talk.asked() == ["PARAM_REQUEST_READ 1"]
    talk.tell(value("B", 2.0, 1))
    end = talk.end()
    assert end.result is OperationResult.ACHIEVED
    assert [p.name for p in end.parameters] == ["A", "B", "C"]


def test_a_list_request_that_is_lost_is_repeated_and_given_up() -> None:
    talk = Conversation(ParameterListing(ADDRESS, bytewise=False))
    for _ in range(8):
        assert talk.asked() == ["PARAM_REQUEST_LIST"]
        talk.wait()
    assert talk.asked() == []
    end = talk.end()
    assert end.result is OperationResult.TIMED_OUT
    assert "does not answer" in end.reason


def test_one_that_never_comes_is_counted() -> None:
    talk = Conversation(ParameterListing(ADDRESS, bytewise=False))
    talk.tell(value("A", 1.0, 0), value("B", 2.0, 1))
    while talk.job.deadline_s is not None:
        talk.wait()
    end = talk.end()
    assert end.result is OperationResult.TIMED_OUT
    assert "1 of 3 parameters did not arrive" in end.reason
    assert [p.name for p in end.parameters] == ["A", "B"]


def test_a_number_of_parameters_that_is_not_true_takes_no_hours() -> None:
    talk = Conversation(ParameterListing(ADDRESS, bytewise=False))
    talk.tell(value("A", 1.0, 0, 65535))
    while talk.job.deadline_s is not None:
        talk.wait()
    assert talk.now < 30.0
    assert talk.end().result is OperationResult.TIMED_OUT


def test_echoes_and_hashes_are_no_part_of_the_list() -> None:
    talk = Conversation(ParameterListing(ADDRESS, bytewise=True))
    talk.tell(value("_HASH_CHECK", 1.0, 65535), value("A", 5.0))
    assert isinstance(talk.job, ParameterListing)
    assert (talk.job.received, talk.job.total) == (0, 0)


def test_another_number_of_parameters_begins_the_list_again() -> None:
    talk = Conversation(ParameterListing(ADDRESS, bytewise=False))
    talk.asked()
    talk.tell(value("A", 1.0, 0, 2), value("NEW", 1.0, 0, 3))
    assert talk.asked() == ["PARAM_REQUEST_LIST"]
    talk.tell(*(value(name, 1.0, i, 3) for i, name in enumerate("ABC")))
    assert talk.end().result is OperationResult.ACHIEVED


def test_a_number_that_keeps_changing_is_given_up() -> None:
    talk = Conversation(ParameterListing(ADDRESS, bytewise=False))
    for _ in range(4):
        talk.tell(value("A", 1.0, 0, 5), value("A", 1.0, 0, 6))
    assert "keeps changing" in talk.end().reason


def test_the_same_name_at_two_indices_begins_the_list_again() -> None:
    talk = Conversation(ParameterListing(ADDRESS, bytewise=False))
    talk.asked()
    talk.tell(value("A", 1.0, 0, 2), value("A", 1.0, 1, 2))
    assert talk.asked() == ["PARAM_REQUEST_LIST"]


def test_many_missing_ones_are_asked_for_a_few_at_a_time() -> None:
    talk = Conversation(ParameterListing(ADDRESS, bytewise=False))
    talk.tell(value("P0", 1.0, 0, 100))
    talk.asked()
    talk.wait()
    assert len(talk.asked()) == 16
    for index in range(1, 17):
        talk.tell(value(f"P{index}", 1.0, index, 100))
    assert talk.asked()[0] == "PARAM_REQUEST_READ 17", "at once, without a wait"


def test_one_that_is_lost_does_not_hold_up_the_others() -> None:
    talk = Conversation(ParameterListing(ADDRESS, bytewise=False))
    talk.tell(value("P0", 1.0, 0, 20))
    talk.wait()
    talk.asked()
    talk.now += 0.5
    talk.tell(value("P3", 1.0, 3, 20))
    assert talk.asked() == ["PARAM_REQUEST_READ 17"]
    talk.wait()
    assert "PARAM_REQUEST_READ 17" not in talk.asked(), "it has half a second left"


# --- changes -------------------------------------------------------------------------------


def changes(objection: str | None = None, **wanted: float | None) -> Conversation:
    return Conversation(ParameterChanges(wanted, ADDRESS, False, lambda: objection))


def test_a_change_is_set_once_and_read_back() -> None:
    talk = changes(A=2.0)
    assert talk.asked() == ["PARAM_REQUEST_READ -1 A"]
    talk.tell(value("OTHER", 2.0), value("A", 1.0))
    assert talk.asked() == ["PARAM_SET  A"]
    talk.tell(value("A", 2.0))
    assert talk.asked() == ["PARAM_REQUEST_READ -1 A"], "the echo alone is no proof"
    talk.tell(value("A", 2.0))
    (outcome,) = talk.end().outcomes
    assert outcome.change is ParameterChange.CHANGED
    assert (outcome.old, outcome.new) == (Parameter("A", 1.0, 9), Parameter("A", 2.0, 9))


def test_an_old_answer_does_not_undo_a_change() -> None:
    talk = changes(A=2.0)
    talk.tell(value("A", 1.0))  # sent before PARAM_SET arrives
    talk.tell(value("A", 1.0), value("A", 1.0))
    talk.asked()
    talk.tell(value("A", 2.0))
    assert talk.end().result is OperationResult.ACHIEVED


def test_a_value_that_is_not_kept_is_set_three_times_and_reported() -> None:
    talk = changes(A=2.0)
    sets = 0
    while talk.job.deadline_s is not None:
        for asked in talk.asked():
            sets += asked.startswith("PARAM_SET")
            talk.tell(value("A", 1.5))
        if talk.job.deadline_s is not None:
            talk.wait()
    end = talk.end()
    assert sets == 3
    assert end.result is OperationResult.REFUSED
    assert end.reason == "A is 1.5 after it was set to 2 3 times."


@pytest.mark.parametrize(
    ("number", "part", "change"),
    [
        (1, "unknown to the autopilot", ParameterChange.UNKNOWN),
        (3, "the autopilot denies the change", ParameterChange.FAILED),
        (5, "it is read-only", ParameterChange.FAILED),
        (77, "PARAM_ERROR 77", ParameterChange.FAILED),
    ],
)
def test_an_error_of_the_autopilot_ends_it(number: int, part: str, change: ParameterChange) -> None:
    talk = changes(A=2.0)
    if change is ParameterChange.FAILED:
        talk.tell(value("A", 1.0))
    talk.tell(error("A", number, component=7))
    assert talk.job.next_event() is None, "it was for somebody else"
    talk.tell(error("A", number))
    end = talk.end()
    assert end.outcomes[0].change is change
    assert part in end.reason


def test_a_silent_autopilot_is_asked_for_a_while() -> None:
    talk = changes(A=None)
    asked = 0
    while talk.job.deadline_s is not None:
        asked += len(talk.asked())
        talk.wait()
    assert asked == 12
    assert talk.end().outcomes[0].change is ParameterChange.UNKNOWN


def test_a_set_that_cannot_be_read_back_is_unknown() -> None:
    talk = changes(A=2.0)
    talk.tell(value("A", 1.0))
    while talk.job.deadline_s is not None:
        talk.wait()
    (outcome,) = talk.end().outcomes
    assert outcome.change is ParameterChange.FAILED
    assert outcome.new is None
    assert "its value is unknown" in outcome.reason


def many(**wanted: float) -> Conversation:
    return Conversation(ParameterChanges(wanted, ADDRESS, False, lambda: None, list_first=True))


def test_names_that_the_list_lacks_are_unknown_at_once() -> None:
    talk = many(NONE=5.0, A=1.0, NEITHER=2.0)
    assert talk.asked() == ["PARAM_REQUEST_LIST"]
    talk.tell(value("A", 1.0, 0, 1))
    assert talk.asked() == []
    end = talk.end()
    assert [outcome.change.name for outcome in end.outcomes] == ["UNKNOWN", "UNCHANGED", "UNKNOWN"]
    assert "it is not in its list" in end.outcomes[0].reason


def test_what_is_unknown_is_tried_again_while_something_changes() -> None:
    """ArduPilot shows some parameters only once others are set: ENABLE, then TYPE, then MAX."""
    talk = many(MAX=5.0, TYPE=2.0, ENABLE=1.0, NONE=3.0)
    listed = {"ENABLE": 0.0}
    for name, wanted in (("ENABLE", 1.0), ("TYPE", 2.0), ("MAX", 5.0)):
        assert talk.asked()[-1] == "PARAM_REQUEST_LIST"
        for index, (known, number) in enumerate(listed.items()):
            talk.tell(value(known, number, index, len(listed)))
        assert talk.asked() == [f"PARAM_SET  {name}"]
        talk.tell(value(name, wanted), value(name, wanted))
        listed[name] = wanted
        listed |= {"ENABLE": {"TYPE": 0.0}, "TYPE": {"MAX": 0.0}, "MAX": {}}[name]
    assert talk.asked()[-1] == "PARAM_REQUEST_LIST"
    for index, (known, number) in enumerate(listed.items()):
        talk.tell(value(known, number, index, len(listed)))
    end = talk.end()
    changed = [outcome.name for outcome in end.outcomes if outcome.change.name == "CHANGED"]
    assert changed == ["MAX", "TYPE", "ENABLE"]
    assert end.outcomes[3].change is ParameterChange.UNKNOWN


def test_what_an_incomplete_list_lacks_is_asked_for_by_name() -> None:
    talk = many(A=1.0, LOST=2.0)
    talk.asked()
    talk.tell(value("A", 1.0, 0, 2))
    asked: list[str] = []
    while not asked or asked[-1] != "PARAM_REQUEST_READ -1 LOST":
        talk.wait()
        asked += talk.asked()
    talk.tell(value("LOST", 2.0))
    assert talk.end().result is OperationResult.ACHIEVED


def test_of_many_what_the_autopilot_maintains_stays() -> None:
    wanted = {"STAT_RUNTIME": 30.0, "A": 1.0, "FORMAT_VERSION": 7.0}
    talk = Conversation(ParameterChanges(wanted, ADDRESS, False, lambda: None, list_first=True))
    for index, name in enumerate(wanted):
        talk.tell(value(name, 50.0, index))
    talk.asked()
    talk.tell(value("A", 1.0))
    assert talk.asked() == ["PARAM_REQUEST_READ -1 A"]
    talk.tell(value("A", 1.0))
    end = talk.end()
    assert end.reason.startswith("3 parameters: 1 changed, 2 unchanged, ")
    assert "the autopilot maintains it" in end.outcomes[0].reason


def test_an_objection_is_asked_for_before_each_change() -> None:
    objections: list[str | None] = [None, "the vehicle is armed"]
    job = ParameterChanges({"A": 1.0, "B": 1.0}, ADDRESS, False, lambda: objections.pop(0))
    talk = Conversation(job)
    talk.tell(value("A", 0.0), value("A", 1.0), value("A", 1.0))
    end = talk.end()
    assert [outcome.change.name for outcome in end.outcomes] == ["CHANGED", "FAILED"]
    assert "B was not changed: the vehicle is armed." in end.outcomes[1].reason


def test_stopping_names_what_is_unknown_now() -> None:
    talk = changes(A=1.0, B=1.0)
    talk.tell(value("A", 0.0))
    talk.job.stop(OperationResult.CANCELLED, "it was cancelled", 1.0)
    end = talk.end()
    assert end.result is OperationResult.CANCELLED
    assert "set, but not read back: it was cancelled" in end.outcomes[0].reason
    assert end.outcomes[1].reason == "B was not changed: it was cancelled."


def test_a_known_value_needs_no_question() -> None:
    one = OneParameter("A", 1.0, ADDRESS, False, known=Parameter("A", 1.0, 9))
    one.start(0.0)
    assert one.messages_to_send() == []
    assert one.outcome is not None
    assert one.outcome.change is ParameterChange.UNCHANGED


def test_a_known_value_that_would_not_be_set_is_unchanged() -> None:
    one = OneParameter("A", 3e38, ADDRESS, False, known=Parameter("A", as_float32(3e38), REAL32))
    one.start(0.0)
    assert one.outcome is not None
    assert one.outcome.change is ParameterChange.UNCHANGED


# --- values --------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("number", "kind", "bytewise", "part"),
    [
        (math.nan, REAL32, False, "not a finite number"),
        (math.inf, INT32, True, "not a finite number"),
        (1e39, REAL32, False, "beyond 10000000"),
        (5e9, REAL32, False, "5e+09 is beyond 10000000"),
        (-1.1e7, REAL32, True, "beyond 10000000"),
        (1e-50, REAL32, False, "sent as a float, which is 0"),
        (5e9, INT32, False, "not an integer from -2147483648"),
        (1.5, INT8, False, "not an integer from -128 to 127"),
        (128.0, INT8, False, "not an integer from -128 to 127"),
        (2.0**31, INT32, True, "not an integer"),
        (16_777_217.0, INT32, False, "rounds it to 16777216"),
        (1.0, 10, False, "is not supported"),
    ],
)
def test_a_value_that_a_type_cannot_have(
    number: float, kind: int, bytewise: bool, part: str
) -> None:
    assert part in (value_problem(number, kind, bytewise) or "")


def test_values_that_types_have_travel_as_the_firmware_wants_them() -> None:
    for number in (0.0, -1.0, 7.0, 2.0**31 - 1, -(2.0**31), 16_777_217.0):
        assert value_problem(number, INT32, bytewise=True) is None
        raw = struct.pack("<f", encode_value(number, INT32, bytewise=True))
        assert struct.unpack("<i", raw)[0] == number
    assert encode_value(5.0, INT8, bytewise=False) == 5.0
    assert encode_value(0.1, REAL32, bytewise=True) == 0.1
    assert same_value(0.1, Parameter("A", as_float32(0.1), REAL32))
    assert not same_value(0.1000001, Parameter("A", as_float32(0.1), REAL32))
    assert not same_value(2.0, Parameter("A", 3.0, INT8))


def carried(number: int) -> bytes | None:
    try:
        return struct.pack("<f", encode_value(float(number), INT32, bytewise=True))
    except ValueError:
        return None


def test_an_integer_whose_bytes_are_no_float_is_not_sent_as_another_one() -> None:
    signalling = 0x7F800001  # a NaN that some processors change on its way through a double
    assert carried(signalling) in (None, struct.pack("<i", signalling))
    assert carried(-1) == struct.pack("<i", -1)


def test_constants_are_those_of_the_dialect() -> None:
    assert (INT8, INT32, REAL32) == (
        mavlink.MAV_PARAM_TYPE_INT8,
        mavlink.MAV_PARAM_TYPE_INT32,
        mavlink.MAV_PARAM_TYPE_REAL32,
    )
