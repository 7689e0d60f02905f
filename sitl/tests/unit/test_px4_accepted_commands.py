"""Each command that a simulated PX4 accepts has an effect, or a reason to have none.

Two vehicles are alike to the last byte but for the command; what can be seen of them differs.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable
from typing import NamedTuple

import pytest
from pymavlink.dialects.v20 import all as mav

from mavlink_sitl.autopilot.personality import px4
from mavlink_sitl.mavlink.px4.commands import BY_KIND
from sitl_support.ground_station import ACCEPTED
from sitl_support.missions import take_off, upload, waypoint
from sitl_support.px4_station import HOME, NAN, Px4Station, at, near_home, ready_px4

pytestmark = pytest.mark.wide

KINDS = ["copter", "rover", "boat", "plane"]
ALL, COPTER, PLANE = frozenset(KINDS), frozenset({"copter"}), frozenset({"plane"})
Place = tuple[float, float]
HERE, THERE = (0.0, 0.0), (60.0, 20.0)


def ground(kind: str) -> Px4Station:
    """Disarmed in AUTO.LOITER; a ground station is heard, a failure may be injected."""
    station = ready_px4(vehicle=kind, parameters={"SYS_FAILURE_EN": 1.0}).quiet()
    station.heartbeats(True)
    station.run(0.2)
    return station


def other_mode(kind: str) -> Px4Station:
    station = ground(kind)
    assert station.mode(px4.POSCTL) == ACCEPTED
    return station


def with_mission(kind: str) -> Px4Station:
    station = ground(kind)
    mission = [take_off(30.0), waypoint(60.0, 0.0, 30.0)]
    if kind == "plane":  # which has to land, too
        station.vehicle.parameters.set("MIS_TKO_LAND_REQ", 0.0)
    assert upload(station, near_home(mission)) == 0
    station.run(0.3)
    return station


def changed(kind: str) -> Px4Station:
    station = ground(kind)
    station.vehicle.parameters.set("MIS_TAKEOFF_ALT", 7.0)
    return station


def underway(kind: str) -> Px4Station:
    """In AUTO.LOITER, high enough to turn; on wheels or afloat armed."""
    station = ground(kind)
    height_m = HOME.altitude_amsl_m + 20.0
    assert station.command(22, 0, 0, 0, NAN, NAN, NAN, height_m) == ACCEPTED
    assert station.arm() == ACCEPTED
    station.run_until(lambda: station.custom_mode == px4.LOITER, timeout_s=60.0)
    return station


def going(kind: str) -> Px4Station:
    """On the way to somewhere else."""
    station = underway(kind)
    x, y = at(*THERE)
    place = {"x": x, "y": y, "z": HOME.altitude_amsl_m + 20.0}
    assert station.command_int(192, 5, -1, 1, 0, NAN, **place) == ACCEPTED  # type: ignore[arg-type]
    station.run(2.0)
    return station


class Case(NamedTuple):
    """A command where it has an effect.

    Attributes:
        where: what the vehicle does before.
        params: param1..4.
        place: NED metres from home, if the command has one.
        up_m: its altitude above home.
        seconds: until the effect is there.
        kinds: of vehicle that accept it.
    """

    where: Callable[[str], Px4Station]
    params: tuple[float, ...] = ()
    place: Place | None = None
    up_m: float = 20.0
    seconds: float = 1.5
    kinds: Iterable[str] = ALL


CASES = {
    20: Case(underway),
    21: Case(underway),
    22: Case(ground, (0.0, 0.0, 0.0, NAN), HERE),
    34: Case(underway, (15.0, 3.0), THERE, seconds=8.0, kinds=COPTER | PLANE),
    176: Case(ground, (1.0, 3.0)),
    178: Case(going, (1.0, 1.2, -1.0), seconds=4.0, kinds=ALL - PLANE),
    179: Case(ground, (0.0,), THERE),
    185: Case(underway, (1.0,)),
    186: Case(other_mode, (HOME.altitude_amsl_m + 40.0,)),
    192: Case(underway, (-1.0, 1.0, 0.0, NAN), THERE, seconds=4.0),
    241: Case(ground, (1.0,)),
    245: Case(changed, (2.0,)),
    246: Case(ground, (1.0,)),
    262: Case(ground, (6.0,)),
    300: Case(with_mission),
    400: Case(ground, (1.0,)),
    410: Case(ground),
    420: Case(underway, (4.0, 1.0), seconds=3.0),
    510: Case(ground, (30.0,)),
    511: Case(ground, (30.0, 20_000.0)),
    512: Case(ground, (148.0,)),
    519: Case(ground, (1.0,)),
    520: Case(ground, (1.0,)),
}
"""By MAV_CMD"""
FASTER = Case(going, (0.0, 19.0, -1.0), seconds=6.0)
"""DO_CHANGE_SPEED of a plane: airspeed"""
WITHOUT_EFFECT = {
    187: "nothing is connected to the outputs",
    191: "no landing of a plane can be broken off here",
    195: "there is no camera, and PX4 turns no vehicle to a region of interest outside of missions",
    197: "the same",
    401: "the checks run all the time; their verdict is in SYS_STATUS",
}
SILENT = {
    35: "a text says that only planes have it",
    203: "for a camera, which is not there",
    205: "for a gimbal, which is not there",
    206: "for a camera trigger, which is not there",
    211: "for a gripper, which is not there",
    521: "for a camera, which is not there",
    1000: "for a gimbal, which is not there",
    1001: "for a gimbal, which is not there",
    3000: "for vehicles with wings and rotors",
}


def send(station: Px4Station, command: int, case: Case) -> int:
    """COMMAND_INT; its last acknowledgement."""
    x, y = at(*case.place) if case.place else (0, 0)
    z = HOME.altitude_amsl_m + case.up_m if case.place else 0.0
    params = [*case.params, *[0.0] * (4 - len(case.params))]
    message = mav.MAVLink_command_int_message(1, 1, 5, command, 0, 0, *params, x, y, z)
    acks = [m for m in station.send(message) if m.get_type() == "COMMAND_ACK"]
    return int(acks[-1].result)


def seen(kind: str, command: int, case: Case, sent: bool) -> object:
    """Messages, texts and state some time after the command, or without it if not `sent`."""
    station = case.where(kind)
    station.log.clear()
    if sent:
        assert send(station, command, case) == ACCEPTED
    station.run(case.seconds)
    vehicle = station.vehicle.firmware
    messages = Counter(m.get_type() for _, m in station.log if m.get_type() != "COMMAND_ACK")
    home = vehicle.navigator.home
    station.command(512, 24)
    station.run(0.1)
    return (
        messages,
        station.texts(),
        vehicle.boot_s,
        vehicle.armed,
        vehicle.mode.spec.name,
        home and tuple(round(value, 5) for value in home),
        tuple(round(value, 1) for value in station.position),
        station.vehicle.parameters["MIS_TAKEOFF_ALT"],
        [m.fix_type for m in station.messages("GPS_RAW_INT")],
    )


ACCEPTED_BY = [(kind, c) for c, case in CASES.items() for kind in KINDS if kind in case.kinds]


@pytest.mark.parametrize(("kind", "command"), [*ACCEPTED_BY, ("plane", 178)])
def test_it_has_an_effect(kind: str, command: int) -> None:
    case = FASTER if (kind, command) == ("plane", 178) else CASES[command]
    assert seen(kind, command, case, True) != seen(kind, command, case, False)


@pytest.mark.parametrize("command", WITHOUT_EFFECT)
@pytest.mark.parametrize("kind", KINDS)
def test_it_is_accepted_without_effect(kind: str, command: int) -> None:
    case = Case(ground, place=THERE)
    assert seen(kind, command, case, True) == seen(kind, command, case, False)


def silent(kind: str) -> set[int]:
    """The commands that this kind does not answer."""
    return SILENT.keys() - ({35} if kind == "plane" else set())


@pytest.mark.parametrize("kind", KINDS)
def test_it_is_not_answered(kind: str) -> None:
    station = ground(kind)
    for command in silent(kind):
        assert station.command(command, 1.0) == -1


@pytest.mark.parametrize("kind", KINDS)
def test_all_that_are_known_are_in_these_tables(kind: str) -> None:
    here = {command for command, case in CASES.items() if kind in case.kinds}
    known = here | {178} | WITHOUT_EFFECT.keys() | silent(kind)
    assert known == set(BY_KIND[f"px4{kind}"])
