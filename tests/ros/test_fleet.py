"""One server with three vehicles: goals at the same time, and one vehicle's trouble its own."""

from __future__ import annotations

import json
import random
import signal
import time
from collections.abc import Iterator

import pytest
from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
from rcl_interfaces.srv import GetParameters, SetParameters

from drone_navigation.processes import free_udp_port
from flight_reports.flight_recording import read_recording
from mavlink_vehicle.codec import Codec, make
from tests.support.processes import patient_s
from tests.support.ros.ros_fleet import FleetFlight, FleetVehicle, Flood, two_ports
from tests.support.ros.ros_flight import FLIGHT_TIMEOUT_S, GoalRecord, navigate_goal

pytestmark = [pytest.mark.wide, pytest.mark.xdist_group("ros_fleet")]

READY_S = patient_s(20.0)
GOALS = {"copter": (6.0, 4.0, 3.0), "px4": (6.0, 4.0, 3.0), "rover": (8.0, 3.0, 0.0)}


@pytest.fixture(scope="module")
def flown(tmp_path_factory: pytest.TempPathFactory) -> Iterator[FleetFlight]:
    shared, other = two_ports()
    flight = FleetFlight(
        tmp_path_factory.mktemp("fleet"),
        (
            FleetVehicle("copter", 1, (), shared),
            FleetVehicle("px4", 2, ("--autopilot", "px4"), shared),
            FleetVehicle("rover", 3, ("--vehicle", "rover"), other),
        ),
    )
    yield flight
    flight.close()


@pytest.fixture
def fleet(flown: FleetFlight) -> FleetFlight:
    """The vehicles as they are, with a server that runs."""
    if flown.server.returncode is not None:
        flown.start_server()
    return flown


def fly_all(
    fleet: FleetFlight, goals: dict[str, tuple[float, float, float]]
) -> dict[str, GoalRecord]:
    records = {}
    for name, place in goals.items():
        goal = navigate_goal(*place)
        goal.target_pose.header.frame_id = f"{name}/map"
        records[name] = fleet.fly(name, goal)
        # A vehicle may be told to be ready a moment before its last check is over.
        limit_s = time.monotonic() + READY_S
        while not records[name].accepted and time.monotonic() < limit_s:
            time.sleep(1.0)
            records[name] = fleet.fly(name, goal)
        assert records[name].accepted, name
    return records


def wait_for_results(fleet: FleetFlight, records: dict[str, GoalRecord]) -> None:
    fleet.wait(
        lambda: all(record.result is not None for record in records.values()),
        FLIGHT_TIMEOUT_S,
        "the end of all goals",
    )


def test_three_vehicles_fly_goals_at_the_same_time_each_in_its_own_map(fleet: FleetFlight) -> None:
    records = fly_all(fleet, GOALS)
    wait_for_results(fleet, records)
    for name, record in records.items():
        assert record.result.message.startswith("SUCCESS"), (name, record.result.message)
        assert record.result.final_pose.header.frame_id == f"{name}/map"
        assert {message.current_pose.header.frame_id for message in record.feedback} == {
            f"{name}/map"
        }
        assert len(record.feedback) > 20, name
    # Each had begun before the first had ended.
    assert all(record.feedback[0].current_status != "SETTLING" for record in records.values())


def test_one_restarts_among_garbage_and_floods_and_the_others_arrive(fleet: FleetFlight) -> None:
    stranger = Codec(source_system=99, source_component=1)
    frames = [stranger.encode(make("ATTITUDE", time_boot_ms=number)) for number in range(200)]
    noise = random.Random(7)
    garbage = [noise.randbytes(noise.randint(1, 280)) for _ in range(100)]
    cut = [frame[: noise.randint(1, len(frame) - 1)] for frame in frames[:50]]
    # Away from the start and from where others may have led them.
    back = {"copter": (0.0, -6.0, 4.0), "px4": (20.0, 20.0, 4.0), "rover": (0.0, -6.0, 0.0)}
    port = fleet.vehicles["copter"].port
    records = fly_all(fleet, back)
    with Flood(port, [*frames, *garbage, *cut]) as flood:
        fleet.wait(lambda: flood.sent > 2000, 20.0, "a flood")
        begun = {name: len(record.feedback) for name, record in records.items()}
        fleet.start_simulator("px4")
        wait_for_results(fleet, records)
    for name in ("copter", "rover"):
        record = records[name]
        assert record.result.message.startswith("SUCCESS"), (name, record.result.message)
        assert len(record.feedback) - begun[name] > 10, name
    assert records["px4"].result.message.startswith(("VEHICLE_REBOOTED", "LINK_LOST"))
    # It is there for the next goal.
    fleet.wait_for_line("[px4.navigation_server]", FLIGHT_TIMEOUT_S)
    fleet.wait(
        lambda: fleet.server.text.count("[px4.navigation_server]: Position valid") > 1,
        FLIGHT_TIMEOUT_S,
        "a position of the vehicle that restarted",
    )
    again = fly_all(fleet, {"px4": (0.0, 3.0, 3.0)})["px4"]
    fleet.wait(lambda: again.result is not None, FLIGHT_TIMEOUT_S, "the end of the goal")
    assert again.result.message.startswith("SUCCESS"), again.result.message


def test_settings_are_changed_on_a_vehicles_own_node(fleet: FleetFlight) -> None:
    value = ParameterValue(type=ParameterType.PARAMETER_DOUBLE, double_value=1.25)
    request = SetParameters.Request(parameters=[Parameter(name="speed_default_m_s", value=value)])
    ask = GetParameters.Request(names=["speed_default_m_s"])
    (answer,) = fleet.call(SetParameters, "/navigation_server/set_parameters", request).results
    assert not answer.successful
    assert "/copter/navigation_server" in answer.reason
    (answer,) = fleet.call(SetParameters, "/px4/navigation_server/set_parameters", request).results
    assert answer.successful, answer.reason
    for name, speed in (("copter", 3.0), ("px4", 1.25)):
        (found,) = fleet.call(
            GetParameters, f"/{name}/navigation_server/get_parameters", ask
        ).values
        assert found.double_value == speed


def test_a_client_that_names_no_vehicle_gets_their_names(fleet: FleetFlight) -> None:
    goal = ("--goal", "0", "0", "200")
    nameless = fleet.run(
        "drone_navigation.navigation_client", "--plain", "--server-timeout", "2", *goal
    )
    named = fleet.run(
        "drone_navigation.navigation_client", "--plain", "--vehicle", "rover", *goal
    )  # fmt: skip
    assert named.wait(60.0) == 3  # refused by the rover: it cannot fly
    assert nameless.wait(60.0) == 5
    assert "choose with --vehicle NAME. Vehicles here: copter, px4, rover." in nameless.text


def test_the_recording_has_each_vehicle_and_notes_about_it(fleet: FleetFlight) -> None:
    for name in ("px4", "rover"):
        system = fleet.vehicles[name].system_id
        recording = read_recording(fleet.tlog, system)
        assert f"system {system}" in recording.vehicle
        assert any("the recording also contains system" in remark for remark in recording.remarks)
        assert len(recording.goals.values) == fleet.accepted[name]


def test_each_of_several_vehicles_is_checked(fleet: FleetFlight) -> None:
    port = free_udp_port()
    path = fleet.config.with_name("check.yaml")
    path.write_text(
        "navigation_server: {ros__parameters: {vehicles: [a, b], arming: auto, "
        f"link_url: 'udpin://127.0.0.1:{port}'}}}}\n"
        "/a/navigation_server: {ros__parameters: {target_system: 11}}\n"
        "/b/navigation_server: {ros__parameters: {target_system: 12}}\n",
        encoding="utf-8",
    )
    fleet.run(
        "mavlink_sitl", "--link", f"udpout://127.0.0.1:{port}", "--count", "2",
        "--system-id", "11", "--ready-after", "1", "--quiet",
    )  # fmt: skip
    check = fleet.run(
        "drone_navigation.navigation_server", "--check", "--no-computer", "--json",
        "--timeout", "40", "--config", str(path),
    )  # fmt: skip
    assert check.wait(80.0) == 0, check.text
    reports = json.loads(check.text[check.text.index("{\n") :])
    assert {name: report["verdict"] for name, report in reports.items()} == {"a": 0, "b": 0}


def test_a_server_that_is_stopped_ends_the_goals_of_all_and_then_itself(
    fleet: FleetFlight,
) -> None:
    records = fly_all(fleet, {"copter": (40.0, 0.0, 4.0), "px4": (40.0, 0.0, 4.0)})
    fleet.wait(
        lambda: all(record.feedback for record in records.values()), FLIGHT_TIMEOUT_S, "feedback"
    )
    fleet.server.signal(signal.SIGINT)
    wait_for_results(fleet, records)
    for name, record in records.items():
        assert record.result.message.startswith("SHUTTING_DOWN"), (name, record.result.message)
    assert fleet.server.wait(30.0) == 0, fleet.server.text[-3000:]
