"""navigation_client reports on a vehicle, and on a missing server."""

from __future__ import annotations

import json
import math
from typing import Any

import pytest
from geometry_msgs.msg import PoseStamped
from sensor_msgs.msg import BatteryState

from custom_interfaces.action import ListVehicleParameters
from custom_interfaces.msg import VehicleParameter, VehicleStatus
from custom_interfaces.srv import GetVehicleParameter
from drone_navigation.client import servers as client_servers
from drone_navigation.client.commands import status_facts, status_lines
from drone_navigation.client.servers import no_server
from drone_navigation.client.storage import _shown


def status(**members: Any) -> VehicleStatus:
    message = VehicleStatus()
    message.connected, message.position_valid = True, True
    message.autopilot, message.mode = "ArduPilot", "GUIDED"
    message.landed_state = VehicleStatus.LANDED_IN_AIR
    for name, value in members.items():
        setattr(message, name, value)
    return message


def pose(x: float) -> PoseStamped:
    message = PoseStamped()
    place = message.pose.position
    place.x, place.y, place.z = x, 2.0, 3.0
    return message


def battery(percentage: float, voltage: float) -> BatteryState:
    return BatteryState(percentage=percentage, voltage=voltage)


def test_the_status_of_a_flying_vehicle_is_complete() -> None:
    seen = status(armed=True, active_goal="ab12", failsafe="none of it", last_status_text="Hi")
    facts = status_facts(seen, pose(1.234), battery(0.5, 12.34))
    assert facts["position_enu_m"] == [1.23, 2.0, 3.0]
    assert (facts["battery_percent"], facts["voltage_v"]) == (50.0, 12.34)
    assert (facts["armed"], facts["landed_state"]) == (True, "in air")
    text = "\n".join(status_lines(facts))
    for words in (
        "GUIDED, armed, in air",
        "east 1.23  north 2.00  up 3.00 m",
        "50 %, 12.3 V",
        "ab12",
        "failsafe  none of it",
        "message   Hi",
    ):
        assert words in text


@pytest.mark.parametrize(
    ("position_valid", "where"), [(False, pose(1.0)), (True, pose(math.nan)), (True, None)]
)
def test_unknown_values_are_null_and_shown_as_unknown(
    position_valid: bool, where: PoseStamped | None
) -> None:
    seen = status(position_valid=position_valid, landed_state=VehicleStatus.LANDED_UNDEFINED)
    facts = status_facts(seen, where, battery(math.nan, math.nan))
    assert facts["position_enu_m"] is None
    assert facts["battery_percent"] is None
    assert facts["landed_state"] is None
    json.dumps(facts, allow_nan=False)
    lines = status_lines(facts)
    assert "position  unknown" in lines
    assert "battery   unknown" in lines
    assert "goal      none" in lines


def test_a_silent_vehicle_is_reported_in_one_line() -> None:
    assert status_lines(status_facts(status(connected=False), None, None)) == [
        "vehicle   not connected; check the link"
    ]


class Graph:
    """The questions to a node's graph that are asked here."""

    def __init__(self, vehicle: str) -> None:
        self._vehicle = vehicle

    def get_namespace(self) -> str:
        return f"/{self._vehicle}"

    def resolve_service_name(self, name: str) -> str:
        return f"/{self._vehicle}/{name}" if self._vehicle else f"/{name}"


@pytest.mark.parametrize(
    ("asked", "there", "sentence"),
    [
        ("", [], "No server offers land; start navigation_server in the same ROS domain."),
        ("a", [], "No server offers a/land; start navigation_server in the same ROS domain."),
        (
            "coptr",
            ["copter", "rover"],
            (
                "No server offers coptr/land; did you mean --vehicle copter? "
                "Vehicles here: copter, rover."
            ),
        ),
        (
            "",
            ["copter", "rover"],
            "No server offers land; choose with --vehicle NAME. Vehicles here: copter, rover.",
        ),
        (
            "coptr",
            [""],
            (
                "No server offers coptr/land; the server here has one vehicle without a name: "
                "omit --vehicle."
            ),
        ),
        # A server that is going, or does not offer this one thing: its own name is no advice.
        (
            "coptr",
            ["coptr"],
            "No server offers coptr/land; start navigation_server in the same ROS domain.",
        ),
    ],
)
def test_available_alternatives_are_listed(
    asked: str, there: list[str], sentence: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    actions: list[tuple[str, list[str]]] = [
        (f"/{name}/navigate_to_waypoint".replace("//", "/"), []) for name in there
    ]
    actions.append(("/dock", []))
    monkeypatch.setattr(client_servers, "get_action_names_and_types", lambda _node: actions)
    assert no_server(Graph(asked), "land") == sentence


def test_integers_are_shown_in_full_and_floats_as_they_are() -> None:
    values = (("A", 2147483647.0, 6), ("B", 4294967296.0, 9), ("C", 0.1, 9), ("D", math.nan, 9))
    parameters = [VehicleParameter(name=n, value=value, type=kind) for n, value, kind in values]
    result = ListVehicleParameters.Result(success=True, message="Read.", parameters=parameters)
    facts, text = _shown(result)
    shown = '{"A": 2147483647, "B": 4294967296, "C": 0.1, "D": null}'
    assert json.dumps(facts["parameters"]) == shown
    assert [line.split()[1] for line in text.splitlines()[:3]] == [
        "2147483647",
        "4294967296",
        "0.1",
    ]
    response = GetVehicleParameter.Response(success=True, parameter=parameters[0])
    assert json.dumps(_shown(response)[0]) == '{"value": 2147483647}'
