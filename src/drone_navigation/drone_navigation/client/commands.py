"""Commands of ``navigation_client`` with a single request: arm, mode, status, ..."""

from __future__ import annotations

import argparse
import json
import math
import sys
from collections.abc import Callable, Mapping
from typing import Any, TypeAlias

from geometry_msgs.msg import PoseStamped
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from sensor_msgs.msg import BatteryState
from std_srvs.srv import Trigger

from custom_interfaces.msg import VehicleStatus
from custom_interfaces.srv import SetMode
from drone_navigation.client.options import (
    EXIT_CANCELED,
    EXIT_NO_SERVER,
    EXIT_REJECTED,
    EXIT_SUCCESS,
)
from drone_navigation.client.process import (
    SPIN_S,
    ServerSigns,
    client_node,
    end_without_server,
    on_interrupt,
    wait_for,
)
from drone_navigation.client.servers import no_server
from drone_navigation.qos import LATCHED_QOS, STREAM_QOS
from navigation_bridge.names import SERVER_NODE_NAME

__all__ = ["ClientCommand", "run_command"]

_Facts: TypeAlias = dict[str, Any]
"""The state of a vehicle by the names of its JSON form; None is unknown"""

# An arming or a mode change may take 10 s (VehicleConfig.operation_timeout_s).
_ANSWER_TIMEOUT_S = 20.0
# Position and battery come several times a second; a vehicle that gives none has none.
_LOOK_S = 2.0
# Of commands whose services have other names.
_SERVICES = {"mode": "set_mode", "photo": "trigger_camera"}


def run_command(
    options: argparse.Namespace, argv: list[str], kind: type[ClientCommand] | None = None
) -> int:
    """Run the command, of a kind of its own or with a single request; return the exit code."""
    with client_node(argv, options.vehicle) as node:
        command = (kind or ClientCommand)(node, options)
        try:
            on_interrupt(command.interrupt)
            code = command.run()
        except KeyboardInterrupt:
            print("Interrupted.", file=sys.stderr)
            code = EXIT_CANCELED
        finally:
            command.close()
        if code in (EXIT_NO_SERVER, EXIT_CANCELED):
            end_without_server(code)
        return code


class ClientCommand:
    """One command, from finding the server to the answer."""

    def __init__(self, node: Node, options: argparse.Namespace) -> None:
        """Prepare."""
        self._node = node
        self._options = options
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(node)
        self._signs = ServerSigns(node)
        self._interrupted = False

    def interrupt(self) -> None:
        """Raise KeyboardInterrupt with the next turn, not in the middle of rclpy."""
        self._interrupted = True

    def close(self) -> None:
        """Shut down the executor before ROS."""
        self._executor.shutdown(timeout_sec=1.0)

    def run(self) -> int:
        """Send the request and show the answer."""
        if self._options.command == "status":
            return self._status()
        name = self._options.command
        kind = SetMode if name == "mode" else Trigger
        service = _SERVICES.get(name, name)
        client = self._node.create_client(kind, f"{SERVER_NODE_NAME}/{service}")
        if not self._wait(client.service_is_ready, self._options.server_timeout):
            return self._without_server()
        request = kind.Request()
        if name == "mode":
            request.mode = self._options.mode
        answer = client.call_async(request)
        if not self._wait_for_answer(answer.done, _ANSWER_TIMEOUT_S, client.service_is_ready):
            return EXIT_NO_SERVER
        result = answer.result()
        self._tell({"success": result.success, "message": result.message}, result.message)
        return EXIT_SUCCESS if result.success else EXIT_REJECTED

    def _status(self) -> int:
        seen: dict[str, VehicleStatus | PoseStamped | BatteryState] = {}
        for kind, topic, qos in (
            (VehicleStatus, "vehicle_status", LATCHED_QOS),
            (PoseStamped, "pose", STREAM_QOS),
            (BatteryState, "battery", STREAM_QOS),
        ):
            self._node.create_subscription(
                kind,
                f"{SERVER_NODE_NAME}/{topic}",
                lambda message, topic=topic: seen.__setitem__(topic, message),
                qos,
            )
        if not self._wait(lambda: "vehicle_status" in seen, self._options.server_timeout):
            return self._without_server()
        if seen["vehicle_status"].connected:
            self._wait(lambda: len(seen) == 3, _LOOK_S)
        facts = status_facts(seen["vehicle_status"], seen.get("pose"), seen.get("battery"))
        self._tell(facts, "\n".join(status_lines(facts)))
        return EXIT_SUCCESS

    def _without_server(self) -> int:
        offered = {"status": "vehicle_status", **_SERVICES}
        return self._no_server(offered.get(self._options.command, self._options.command))

    def _no_server(self, name: str) -> int:
        text = no_server(self._node, f"{SERVER_NODE_NAME}/{name}")
        self._tell({"success": False, "message": text}, text)
        return EXIT_NO_SERVER

    def _tell(self, facts: Mapping[str, object], text: str) -> None:
        if self._options.json:
            print(json.dumps({"event": self._options.command, **facts}, allow_nan=False))
        else:
            print(text)

    def _wait(self, condition: Callable[[], bool], timeout_s: float) -> bool:
        return wait_for(condition, timeout_s, self._spin_once)

    def _wait_for_answer(
        self, is_done: Callable[[], bool], timeout_s: float, is_ready: Callable[[], bool]
    ) -> bool:
        """Wait as long as there is a server; return whether it has answered, else show why not."""
        why = self._signs.wait_for_answer(is_done, is_ready, timeout_s, self._spin_once)
        if why:
            self._tell({"success": False, "message": why}, why)
        return not why

    def _spin_once(self) -> None:
        self._executor.spin_once(timeout_sec=SPIN_S)
        if self._interrupted:
            self._interrupted = False
            raise KeyboardInterrupt


def status_facts(
    status: VehicleStatus, pose: PoseStamped | None, battery: BatteryState | None
) -> _Facts:
    """Return the state of a vehicle for JSON; unknown values are null."""
    facts: _Facts = {
        "connected": status.connected,
        "autopilot": status.autopilot or None,
        "firmware_version": status.firmware_version or None,
        "mode": status.mode or None,
        "armed": status.armed,
        "landed_state": {
            VehicleStatus.LANDED_ON_GROUND: "on ground",
            VehicleStatus.LANDED_IN_AIR: "in air",
            VehicleStatus.LANDED_TAKEOFF: "taking off",
            VehicleStatus.LANDED_LANDING: "landing",
        }.get(status.landed_state),
        "position_valid": status.position_valid,
        "position_enu_m": None,
        "battery_percent": None,
        "voltage_v": None,
        "failsafe": status.failsafe or None,
        "active_goal": status.active_goal or None,
        "last_status_text": status.last_status_text or None,
    }
    if pose is not None and status.position_valid:
        place = pose.pose.position
        if math.isfinite(place.x):
            facts["position_enu_m"] = [round(value, 2) for value in (place.x, place.y, place.z)]
    if battery is not None:
        if math.isfinite(battery.percentage):
            facts["battery_percent"] = round(100.0 * battery.percentage, 1)
        if math.isfinite(battery.voltage):
            facts["voltage_v"] = round(battery.voltage, 2)
    return facts


def status_lines(facts: _Facts) -> list[str]:
    """Return the same as text lines."""
    if not facts["connected"]:
        return ["vehicle   not connected; check the link"]
    name = " ".join(part for part in (facts["autopilot"], facts["firmware_version"]) if part)
    armed = "armed" if facts["armed"] else "disarmed"
    state = ", ".join(part for part in (facts["mode"], armed, facts["landed_state"]) if part)
    place = "unknown"
    if facts["position_enu_m"] is not None:
        east, north, up = facts["position_enu_m"]
        place = f"east {east:.2f}  north {north:.2f}  up {up:.2f} m"
    charge = "unknown"
    if facts["battery_percent"] is not None:
        charge = f"{facts['battery_percent']:.0f} %"
    if facts["voltage_v"] is not None:
        charge += f", {facts['voltage_v']:.1f} V"
    lines = [
        f"vehicle   {name}",
        f"state     {state}",
        f"position  {place}",
        f"battery   {charge}",
        f"goal      {facts['active_goal'] or 'none'}",
    ]
    if facts["failsafe"]:
        lines.append(f"failsafe  {facts['failsafe']}")
    if facts["last_status_text"]:
        lines.append(f"message   {facts['last_status_text']}")
    return lines
