"""Fence, rally points and parameters written to simulated vehicles, over good links and bad."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from mavlink_sitl import LinkFaults, PlanType
from mavlink_sitl import VehicleConfig as SimulatedVehicleConfig
from mavlink_vehicle.codec import Message, mavlink
from mavlink_vehicle.events import (
    OperationFinished,
    OperationResult,
    ParameterChange,
    ParametersFinished,
    StoredListFinished,
)
from mavlink_vehicle.mission_items import AMSL, RELATIVE_ALT, MissionItem, MissionType
from tests.support.flights.vehicle_pair import BAD_RADIO, VehiclePair

pytestmark = pytest.mark.wide_but_first


LOSSY = LinkFaults(loss=0.2)
HOME_1E7 = (-353632610, 1491652300)
FENCE, RALLY = MissionType.FENCE, MissionType.RALLY
LISTS = {FENCE: PlanType.FENCE, RALLY: PlanType.RALLY}
AUTOPILOTS = ("ardupilot", "px4")
INT32 = mavlink.MAV_PARAM_TYPE_INT32


def corner(north: int, east: int, corners: int = 4, command: int = 5001) -> MissionItem:
    x, y = HOME_1E7[0] + north * 1000, HOME_1E7[1] + east * 1000
    return MissionItem(command, mavlink.MAV_FRAME_GLOBAL, (float(corners), 0.0, 0.0, 0.0), x, y)


def fence(size: int = 10, radius_m: float = 12.5) -> tuple[MissionItem, ...]:
    square = [(-size, -size), (-size, size), (size, size), (size, -size)]
    centre = MissionItem(5004, mavlink.MAV_FRAME_GLOBAL, (radius_m, 0.0, 0.0, 0.0), *HOME_1E7)
    return (*(corner(*place) for place in square), centre)


def rally(*altitudes_m: float, frame: int = RELATIVE_ALT) -> tuple[MissionItem, ...]:
    return tuple(
        MissionItem(5100, frame, x=HOME_1E7[0] + number, y=HOME_1E7[1], z=altitude_m)
        for number, altitude_m in enumerate(altitudes_m)
    )


def pair_of(
    autopilot: str, faults: LinkFaults | None = None, seed: int = 1, vehicle: str = "copter"
) -> VehiclePair:
    simulated = SimulatedVehicleConfig(
        autopilot=autopilot, vehicle=vehicle, ready_after_s=1.0, faults=faults
    )
    return VehiclePair(seed, faults, simulated=simulated).ready()


def ended(pair: VehiclePair, timeout_s: float = 100.0) -> StoredListFinished:
    """Continue until a transfer of a list has ended."""
    before = len(pair.all(StoredListFinished))
    pair.run_until(lambda: len(pair.all(StoredListFinished)) > before, timeout_s)
    return pair.all(StoredListFinished)[-1]


def write(pair: VehiclePair, kind: MissionType, *items: MissionItem) -> StoredListFinished:
    assert pair.vehicle.storage.write_list(kind, items, pair.now) is None
    return ended(pair)


def stored(pair: VehiclePair, kind: MissionType) -> list[tuple[int, int, int, float, float]]:
    """Return what the simulated vehicle has: command, place, first parameter, altitude."""
    items = pair.simulation.vehicles[0].firmware.plans.of(LISTS[kind]).items
    return [(item.command, item.x, item.y, item.params[0], item.z) for item in items]


def shown(items: tuple[MissionItem, ...]) -> list[tuple[int, int, int, float, float]]:
    return [(item.command, item.x, item.y, item.params[0], item.z) for item in items]


# --- lists ---------------------------------------------------------------------------------


@pytest.mark.parametrize("faults", [None, LOSSY, BAD_RADIO], ids=["good", "lossy", "bad radio"])
@pytest.mark.parametrize("autopilot", AUTOPILOTS)
def test_lists_are_written_read_back_replaced_and_removed(
    autopilot: str, faults: LinkFaults | None
) -> None:
    pair = pair_of(autopilot, faults)
    for kind, items in (
        (FENCE, fence()),
        (FENCE, fence(20)[:4]),
        (FENCE, ()),
        (RALLY, rally(10.0, 20.0)),
        (RALLY, rally(600.0, frame=AMSL)),
        (RALLY, ()),
    ):
        end = write(pair, kind, *items)
        assert end.result is OperationResult.ACHIEVED, end.reason
        assert stored(pair, kind) == shown(items)
        assert len(end.items or ()) == len(items)
        known = (
            pair.vehicle.stored_lists.fence
            if kind is FENCE
            else pair.vehicle.stored_lists.rally_points
        )
        assert known == end.items
    assert pair.vehicle.storage.read_list(RALLY, pair.now) is None
    assert ended(pair).items == ()


def test_altitudes_of_rally_points_are_whole_metres_on_an_ardupilot_only() -> None:
    for autopilot, altitude_m in (("ardupilot", 12.0), ("px4", 12.4)):
        pair = pair_of(autopilot)
        end = write(pair, RALLY, *rally(12.4))
        assert end.result is OperationResult.ACHIEVED, end.reason
        (item,) = stored(pair, RALLY)
        assert item[4] == pytest.approx(altitude_m)


@pytest.mark.parametrize("autopilot", AUTOPILOTS)
def test_a_rejected_fence_leaves_the_former_one_and_says_so(autopilot: str) -> None:
    pair = pair_of(autopilot)
    write(pair, FENCE, *fence())
    two_corners = (corner(0, 0, 2), corner(0, 5, 2))
    end = write(pair, FENCE, *two_corners)
    assert end.result is OperationResult.REFUSED
    assert "The former list (5 items)" in end.reason
    assert stored(pair, FENCE) == shown(fence())


@pytest.mark.parametrize("autopilot", AUTOPILOTS)
def test_rally_points_that_are_rejected_half_way_are_restored(autopilot: str) -> None:
    """An ArduPilot stores them as they come; a PX4 exchanges the list as a whole."""
    pair = pair_of(autopilot)
    former = rally(10.0, 20.0, 30.0)
    write(pair, RALLY, *former)
    bad = MissionItem(5100, mavlink.MAV_FRAME_LOCAL_NED, x=HOME_1E7[0], y=HOME_1E7[1])
    end = write(pair, RALLY, *rally(50.0), bad)
    assert end.result is OperationResult.REFUSED
    assert "frame" in end.reason
    how = "was restored" if autopilot == "ardupilot" else "is still stored"
    assert f"The former list (3 items) {how}." in end.reason
    assert stored(pair, RALLY) == shown(former)
    assert pair.vehicle.stored_lists.rally_points == end.items


@pytest.mark.parametrize("autopilot", AUTOPILOTS)
def test_too_many_items_are_rejected_by_the_autopilot(autopilot: str) -> None:
    pair = pair_of(autopilot)
    write(pair, RALLY, *rally(10.0))
    end = write(pair, RALLY, *rally(*[5.0] * 100))
    assert end.result is OperationResult.REFUSED
    assert "no space" in end.reason
    assert stored(pair, RALLY) == shown(rally(10.0))


def cut(pair: VehiclePair, drops: Callable[[Message], bool]) -> None:
    """Lose what we send, as far as it is dropped."""
    vehicle, original = pair.vehicle, pair.vehicle.messages_to_send
    vehicle.messages_to_send = lambda: [m for m in original() if not drops(m)]  # type: ignore[method-assign]


@pytest.mark.parametrize("autopilot", AUTOPILOTS)
@pytest.mark.parametrize("kind", [FENCE, RALLY])
def test_an_upload_that_is_cut_off_is_repaired_when_the_link_is_back(
    autopilot: str, kind: MissionType
) -> None:
    """Its second item never gets through, so that the autopilot gives up, again and again."""
    pair = pair_of(autopilot)
    former = fence() if kind is FENCE else rally(10.0, 20.0, 30.0)
    write(pair, kind, *former)
    new = fence(30) if kind is FENCE else rally(50.0, 60.0, 70.0)
    lost = new[1]
    cut(
        pair,
        lambda m: (
            m.get_type() == "MISSION_ITEM_INT" and (m.x, m.y, m.z) == (lost.x, lost.y, lost.z)
        ),
    )
    end = write(pair, kind, *new)
    assert end.result is not OperationResult.ACHIEVED
    assert f"The former list ({len(former)} items)" in end.reason
    assert stored(pair, kind) == shown(former)


@pytest.mark.parametrize("autopilot", AUTOPILOTS)
def test_a_link_that_is_lost_under_way_leaves_it_unknown_and_says_so(autopilot: str) -> None:
    pair = pair_of(autopilot)
    write(pair, RALLY, *rally(10.0))
    assert pair.vehicle.storage.write_list(RALLY, rally(50.0, 60.0), pair.now) is None
    pair.run_until(lambda: "MISSION_COUNT" in pair.names_sent()[-3:])
    cut(pair, lambda _: True)
    end = ended(pair)
    assert end.result is OperationResult.TIMED_OUT
    assert "unknown" in end.reason
    assert end.items is None


def test_a_list_that_cannot_be_read_is_not_overwritten() -> None:
    pair = pair_of("ardupilot")
    cut(pair, lambda m: m.get_type() == "MISSION_REQUEST_LIST")
    end = write(pair, FENCE, *fence())
    assert end.result is OperationResult.TIMED_OUT
    assert end.reason.endswith("Nothing was sent.")
    assert "MISSION_COUNT" not in pair.names_sent()


def test_one_transfer_at_a_time() -> None:
    pair = pair_of("px4")
    assert pair.vehicle.storage.write_list(FENCE, fence(), pair.now) is None
    assert "Another list" in (pair.vehicle.storage.read_list(RALLY, pair.now) or "")
    mission = pair.vehicle.missions.download(pair.now)
    assert pair.finish(mission).result is OperationResult.REFUSED
    assert ended(pair).result is OperationResult.ACHIEVED
    mission = pair.vehicle.missions.download(pair.now)
    assert "Another list" in (pair.vehicle.storage.write_list(FENCE, (), pair.now) or "")
    assert pair.finish(mission).result is OperationResult.ACHIEVED
    assert pair.vehicle.storage.read_list(FENCE, pair.now) is None
    mission = pair.vehicle.missions.download(pair.now)
    assert pair.finish(mission).result is OperationResult.ACHIEVED, "a reading makes way"
    assert pair.all(StoredListFinished)[-1].result is OperationResult.CANCELLED


def test_a_restart_ends_the_transfer() -> None:
    pair = pair_of("ardupilot")
    cut(pair, lambda m: m.get_type() == "MISSION_ITEM_INT")
    assert pair.vehicle.storage.write_list(FENCE, fence(), pair.now) is None
    pair.run_until(lambda: "MISSION_COUNT" in pair.names_sent())
    pair.reboot()
    end = ended(pair)
    assert end.result is OperationResult.LINK_LOST
    assert "restarted" in end.reason


# --- parameters ----------------------------------------------------------------------------


def parameters_ended(pair: VehiclePair, timeout_s: float = 200.0) -> ParametersFinished:
    before = len(pair.all(ParametersFinished))
    pair.run_until(lambda: len(pair.all(ParametersFinished)) > before, timeout_s)
    return pair.all(ParametersFinished)[-1]


def change(
    pair: VehiclePair, wanted: dict[str, float | None], objection: str | None = None
) -> ParametersFinished:
    began = pair.vehicle.storage.change_parameters(
        wanted, lambda: objection, pair.now, list_first=len(wanted) > 1
    )
    assert began is None
    return parameters_ended(pair)


@pytest.mark.parametrize("faults", [None, LOSSY, BAD_RADIO], ids=["good", "lossy", "bad radio"])
@pytest.mark.parametrize("autopilot", AUTOPILOTS)
def test_all_parameters_are_read_whatever_is_lost(
    autopilot: str, faults: LinkFaults | None
) -> None:
    pair = pair_of(autopilot, faults)
    assert pair.vehicle.storage.list_parameters(pair.now) is None
    end = parameters_ended(pair)
    assert end.result is OperationResult.ACHIEVED, end.reason
    has = pair.simulation.vehicles[0].parameters
    assert [p.name for p in end.parameters] == sorted(has.names())
    for parameter in end.parameters:
        assert parameter.value == pytest.approx(has[parameter.name], rel=1e-6)
        assert parameter.type == has.specs[parameter.name].type
    asked = [m for _, m in pair.sent if m.get_type() == "PARAM_REQUEST_READ" and m.param_index >= 0]
    assert bool(asked) == (faults is not None)


@pytest.mark.parametrize("faults", [None, BAD_RADIO], ids=["good", "bad radio"])
@pytest.mark.parametrize(
    ("autopilot", "name", "value"),
    [
        ("ardupilot", "WPNAV_SPEED", 432.5),
        ("ardupilot", "FENCE_TYPE", 5.0),
        ("px4", "MPC_XY_CRUISE", 3.1),
        ("px4", "GF_ACTION", 1.0),
        ("px4", "GF_ACTION", -1.0),
    ],
)
def test_a_change_is_read_back(
    autopilot: str, name: str, value: float, faults: LinkFaults | None
) -> None:
    pair = pair_of(autopilot, faults)
    has = pair.simulation.vehicles[0].parameters
    before = has[name]
    end = change(pair, {name: value})
    assert end.result is OperationResult.ACHIEVED, end.reason
    (outcome,) = end.outcomes
    assert outcome.change is ParameterChange.CHANGED
    assert outcome.old is not None
    assert outcome.new is not None
    assert outcome.old.value == pytest.approx(before)
    assert outcome.new.value == pytest.approx(value)
    assert has[name] == pytest.approx(value)
    count = pair.names_sent().count("PARAM_SET")
    end = change(pair, {name: value})
    assert end.outcomes[0].change is ParameterChange.UNCHANGED
    assert pair.names_sent().count("PARAM_SET") == count, "it has the value already"


@pytest.mark.parametrize("autopilot", AUTOPILOTS)
def test_what_cannot_be_set_is_not_sent(autopilot: str) -> None:
    pair = pair_of(autopilot)
    integer = "FENCE_TYPE" if autopilot == "ardupilot" else "GF_ACTION"
    for value in (1.5, 3e9, float("nan"), float("inf")):
        end = change(pair, {integer: value})
        assert end.result is OperationResult.REFUSED
        assert end.outcomes[0].change is ParameterChange.FAILED
    end = change(pair, {"NO_SUCH_ONE": 1.0})
    assert end.outcomes[0].change is ParameterChange.UNKNOWN
    assert "PARAM_SET" not in pair.names_sent()
    end = change(pair, {integer: 1.0}, "the vehicle is armed")
    assert "the vehicle is armed" in end.reason
    assert "PARAM_SET" not in pair.names_sent()


@pytest.mark.parametrize("faults", [None, LOSSY], ids=["good", "lossy"])
@pytest.mark.parametrize("autopilot", AUTOPILOTS)
def test_many_are_changed_and_each_is_accounted_for(
    autopilot: str, faults: LinkFaults | None
) -> None:
    pair = pair_of(autopilot, faults)
    has = pair.simulation.vehicles[0].parameters
    wanted: dict[str, float | None] = {name: has[name] for name in has.names()}
    integer = "FENCE_TYPE" if autopilot == "ardupilot" else "GF_ACTION"
    real = "WPNAV_SPEED" if autopilot == "ardupilot" else "MPC_XY_CRUISE"
    wanted |= {integer: 1.25, real: 7.5, "NO_SUCH_ONE": 3.0}
    end = change(pair, wanted)
    assert end.result is OperationResult.REFUSED
    by_change = {
        kind: [o.name for o in end.outcomes if o.change is kind] for kind in ParameterChange
    }
    assert by_change[ParameterChange.CHANGED] == [real]
    assert by_change[ParameterChange.UNKNOWN] == ["NO_SUCH_ONE"]
    assert by_change[ParameterChange.FAILED] == [integer]
    assert len(by_change[ParameterChange.UNCHANGED]) == len(wanted) - 3
    assert has[real] == 7.5
    assert {m.param_id for _, m in pair.sent if m.get_type() == "PARAM_SET"} == {real}


@pytest.mark.parametrize("autopilot", AUTOPILOTS)
def test_names_that_the_list_lacks_cost_no_time(autopilot: str) -> None:
    """A file of another version has hundreds of them; each took 12 questions, twice."""
    pair = pair_of(autopilot)
    real = "WPNAV_SPEED" if autopilot == "ardupilot" else "MPC_XY_CRUISE"
    unknown = [f"NO_SUCH_{number}" for number in range(244)]
    before_s = pair.now
    end = change(pair, {real: 4.5, **dict.fromkeys(unknown, 1.0)})
    assert "1 changed, 0 unchanged, 244 unknown" in end.reason
    assert pair.now - before_s < 10.0
    asked = {m.param_id for _, m in pair.sent if m.get_type() == "PARAM_REQUEST_READ"}
    assert not asked & set(unknown)


def test_integers_are_shown_in_full() -> None:
    pair = pair_of("px4")
    has = pair.simulation.vehicles[0].parameters
    name = next(name for name in has.names() if has.specs[name].type == INT32)
    for value in (2147483647.0, -2147483648.0):
        assert f"{name} is {value:.0f}, read back" in change(pair, {name: value}).reason
        assert f"{name} is {value:.0f}." in change(pair, {name: None}).reason
        assert f"{name} is {value:.0f} already." in change(pair, {name: value}).reason
    end = change(pair, {name: 4294967296.0})
    assert "4294967296 is not an integer from" in end.reason


def test_a_value_that_the_autopilot_does_not_keep_is_reported() -> None:
    pair = pair_of("ardupilot")
    has = pair.simulation.vehicles[0].parameters
    original = has.set
    has.set = lambda name, value: original(name, min(value, 500.0))  # type: ignore[method-assign]
    end = change(pair, {"WPNAV_SPEED": 900.0})
    assert end.result is OperationResult.REFUSED
    assert "500" in end.reason
    assert end.outcomes[0].new is not None
    assert end.outcomes[0].new.value == 500.0


@pytest.mark.parametrize("number", [5e9, -5e9, 1e-50, 3.5e38])
@pytest.mark.parametrize(
    ("autopilot", "name"), [("ardupilot", "WPNAV_SPEED"), ("px4", "MPC_XY_CRUISE")]
)
def test_a_number_that_no_parameter_has_is_not_sent(
    autopilot: str, name: str, number: float
) -> None:
    pair = pair_of(autopilot)
    before = pair.simulation.vehicles[0].parameters[name]
    end = change(pair, {name: number})
    assert end.result is OperationResult.REFUSED
    assert end.reason.startswith(f"{name} was not changed: {number:g} is ")
    assert "PARAM_SET" not in pair.names_sent()
    assert pair.simulation.vehicles[0].parameters[name] == before


def test_a_job_is_stopped_and_what_was_not_done_is_named() -> None:
    pair = pair_of("ardupilot", LOSSY)
    has = pair.simulation.vehicles[0].parameters
    wanted: dict[str, float | None] = {name: has[name] + 1.0 for name in has.names()}
    storage = pair.vehicle.storage
    assert storage.change_parameters(wanted, lambda: None, pair.now, list_first=True) is None
    assert "Parameters are being" in (storage.list_parameters(pair.now) or "")
    pair.run_until(lambda: storage.parameter_progress[:2] >= (True, 5), 100.0)
    storage.stop_parameters("it was cancelled", pair.now)
    pair.run_for(0.1)
    (end,) = pair.all(ParametersFinished)
    assert end.result is OperationResult.CANCELLED
    assert [outcome.name for outcome in end.outcomes] == list(wanted)
    changed = [o for o in end.outcomes if o.change is ParameterChange.CHANGED]
    assert 4 <= len(changed) < len(wanted)
    pair.run_for(5.0)
    sets = pair.names_sent().count("PARAM_SET")
    pair.run_for(5.0)
    assert pair.names_sent().count("PARAM_SET") == sets


def test_a_silent_autopilot_ends_the_changes_and_none_is_called_unknown() -> None:
    pair = pair_of("px4")
    has = pair.simulation.vehicles[0].parameters
    wanted: dict[str, float | None] = {name: has[name] for name in has.names()}
    cut(pair, lambda m: m.get_type() == "PARAM_SET")
    wanted |= {"MPC_XY_CRUISE": 7.0}
    storage = pair.vehicle.storage
    assert storage.change_parameters(wanted, lambda: None, pair.now, list_first=True) is None
    pair.run_until(lambda: "PARAM_REQUEST_READ" in pair.names_sent()[-3:], 20.0)
    pair.vehicle.receive = lambda message, now: None  # type: ignore[method-assign] # noqa: ARG005
    end = parameters_ended(pair)
    assert end.result is OperationResult.LINK_LOST
    assert "silent" in end.reason
    assert not [o for o in end.outcomes if o.change is ParameterChange.UNKNOWN]


def test_nothing_is_done_to_a_vehicle_that_is_not_there() -> None:
    pair = VehiclePair()
    storage = pair.vehicle.storage
    for obstacle in (
        storage.read_list(FENCE, 0.0),
        storage.write_list(FENCE, fence(), 0.0),
        storage.list_parameters(0.0),
        storage.change_parameters({"A": 1.0}, lambda: None, 0.0),
    ):
        assert obstacle is not None
        assert "No vehicle" in obstacle


def test_operations_continue_beside_it() -> None:
    pair = pair_of("ardupilot", LOSSY)
    assert pair.vehicle.storage.write_list(FENCE, fence(), pair.now) is None
    assert pair.vehicle.storage.list_parameters(pair.now) is None
    mode = pair.vehicle.change_mode("GUIDED", pair.now)
    assert pair.finish(mode).result is OperationResult.ACHIEVED
    pair.run_until(lambda: bool(pair.all(ParametersFinished) and pair.all(StoredListFinished)))
    assert len(pair.all(OperationFinished)) == 1
    assert pair.all(StoredListFinished)[0].result is OperationResult.ACHIEVED
