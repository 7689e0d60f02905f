"""The download half of the mission service: sends the three stored lists, item by item."""

from __future__ import annotations

import struct
from collections.abc import Callable
from typing import TYPE_CHECKING

from mavlink_sitl.autopilot.plans.plans import Cmd, Plan, PlanItem, PlanType
from mavlink_sitl.mavlink.codec import Extended, Message, dialect
from mavlink_sitl.mavlink.missions import mission_items as items

if TYPE_CHECKING:
    from mavlink_sitl.autopilot.common.commander import Commander


class MissionSender:
    """Gives one vehicle's lists away."""

    def __init__(self, vehicle: Commander, send: Callable[[Message], None]) -> None:
        self._vehicle = vehicle
        self._rules = vehicle.personality.plan_rules
        self._send = send
        self.handlers: dict[str, Callable[[Message], None]] = {
            "MISSION_REQUEST_LIST": self._on_request_list,
            "MISSION_REQUEST": self._on_request,
            "MISSION_REQUEST_INT": self._on_request,
            "MISSION_REQUEST_PARTIAL_LIST": self._on_request_partial_list,
        }

    def _on_request_list(self, message: Message) -> None:
        plan_type = message.mission_type
        count = dialect.MAVLink_mission_count_message(
            *sender_of(message), len(listed(self._vehicle, plan_type)), plan_type
        )
        self._send(self._identified(count, self._vehicle.plans.of(plan_type)))

    def _on_request(self, message: Message) -> None:
        given = listed(self._vehicle, message.mission_type)
        if message.seq >= len(given):
            self._ack(sender_of(message), items.INVALID_SEQUENCE, message.mission_type)
            return
        plans = self._vehicle.plans
        current = message.mission_type == PlanType.MISSION and message.seq == plans.current
        if self._rules.home_first and message.seq == 0:
            current = False
        self._send(
            items.to_message(
                given[message.seq],
                message.seq,
                current,
                sender_of(message),
                message.mission_type,
                message.get_type() == "MISSION_REQUEST_INT",
            )
        )

    def _on_request_partial_list(self, message: Message) -> None:
        self._ack(sender_of(message), items.UNSUPPORTED, message.mission_type)

    def _ack(self, target: tuple[int, int], result: int, plan_type: int) -> None:
        ack = dialect.MAVLink_mission_ack_message(*target, result, plan_type)
        plan = Plan()
        if result == items.OK and plan_type in [*PlanType]:
            plan = self._vehicle.plans.of(plan_type)
        self._send(self._identified(ack, plan))

    def _identified(self, message: Message, plan: Plan) -> Message:
        if not self._rules.identified:
            return message
        return Extended(message, struct.pack("<I", plan.identity))


def listed(vehicle: Commander, plan_type: int) -> list[PlanItem]:
    """A list as it is given away: with home in its place."""
    stored = vehicle.plans.of(plan_type).items
    if plan_type != PlanType.MISSION or not vehicle.personality.plan_rules.home_first:
        return stored
    home = vehicle.navigator.home
    if home is None:
        return stored
    x, y = items.degrees_to_int(home.latitude_deg), items.degrees_to_int(home.longitude_deg)
    return [PlanItem(Cmd.WAYPOINT, 0, x=x, y=y, z=home.altitude_amsl_m), *stored[1:]]


def sender_of(message: Message) -> tuple[int, int]:
    """System and component."""
    return message.get_srcSystem(), message.get_srcComponent()
