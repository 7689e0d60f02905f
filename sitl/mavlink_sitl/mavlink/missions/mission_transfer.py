"""The mission service: upload, download, clearing and the current item, for all three lists.

One upload at a time. The differences between the firmwares are in `autopilot.plan_rules`, with the
recording or source that each rule comes from. Sans-IO: time is an argument, answers go to `send`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from mavlink_sitl.autopilot.plans.plans import Cmd, PlanItem, PlanType
from mavlink_sitl.exchange import Result, Severity
from mavlink_sitl.mavlink.codec import Message, dialect
from mavlink_sitl.mavlink.messages.streams import NEVER_US
from mavlink_sitl.mavlink.missions import mission_items as items
from mavlink_sitl.mavlink.missions.fence_items import fence_fault, fence_total
from mavlink_sitl.mavlink.missions.mission_download import MissionSender, sender_of

if TYPE_CHECKING:
    from mavlink_sitl.autopilot.common.commander import Commander

ALL_TYPES = 255
_GUIDED_TARGET, _GUIDED_HEIGHT = 2, 3
"""MISSION_ITEM.current of a target for GUIDED, or only its height; not a part of a mission"""
_MISSION_CURRENT = 42


@dataclass
class _Upload:
    """An upload in progress.

    Attributes:
        sender: system and component.
        plan_type: which list.
        place: the item that is asked for.
        end: one after the last.
        taken: the items so far, where they do not go into their places at once.
        asked_us: when it was last asked for.
        heard_us: when the last item came.
        current: the latest item that was sent as the current one.
        first: the first item that is replaced.
        kept: those behind the last that is replaced.
    """

    sender: tuple[int, int]
    plan_type: PlanType
    place: int
    end: int
    taken: list[PlanItem]
    asked_us: int
    heard_us: int
    current: int | None = None
    first: int = 0
    kept: tuple[PlanItem, ...] = ()


class MissionServer(MissionSender):
    """Answers for one vehicle's lists.

    Args:
        send: takes messages to send.
        send_later: takes ids of telemetry to send after the answer.
    """

    def __init__(
        self,
        vehicle: Commander,
        send: Callable[[Message], None],
        send_later: Callable[[int], None],
    ) -> None:
        super().__init__(vehicle, send)
        self._send_later = send_later
        self._upload: _Upload | None = None
        self._now_us = 0
        self.handlers |= {
            "MISSION_COUNT": self._on_count,
            "MISSION_WRITE_PARTIAL_LIST": self._on_write_partial_list,
            "MISSION_ITEM": self._on_item,
            "MISSION_ITEM_INT": self._on_item,
            "MISSION_CLEAR_ALL": self._on_clear_all,
            "MISSION_SET_CURRENT": self._on_set_current,
        }

    # Time.

    def receive(self, message: Message, now_us: int) -> None:
        """One of the messages in `handlers`."""
        self._now_us = now_us
        known = [*PlanType]
        if message.get_type() == "MISSION_CLEAR_ALL" and self._rules.clears_all_types:
            known.append(ALL_TYPES)
        if getattr(message, "mission_type", 0) in known:
            self.handlers[message.get_type()](message)
        else:
            self._ack(sender_of(message), items.UNSUPPORTED, message.mission_type)

    def next_due_us(self) -> int:
        """The time at which `tick` has something to do."""
        upload = self._upload
        if upload is None:
            return NEVER_US
        retry, limit = round(self._rules.retry_s * 1e6), round(self._rules.timeout_s * 1e6)
        return min(upload.asked_us + retry, upload.heard_us + limit)

    def tick(self, now_us: int) -> None:
        """Ask again, or give up."""
        self._now_us = now_us
        upload = self._upload
        if upload is None or now_us < self.next_due_us():
            return
        if now_us < upload.heard_us + round(self._rules.timeout_s * 1e6):
            self._ask(upload)
            return
        self._upload = None
        if self._rules.timeout_result is not None:
            self._ack(upload.sender, self._rules.timeout_result, upload.plan_type)
        self._vehicle.say(
            Severity.WARNING if self._rules.in_place else Severity.CRITICAL,
            self._rules.timeout_text,
        )

    # Upload.

    def _on_count(self, message: Message) -> None:
        plan_type = PlanType(message.mission_type)
        sender = sender_of(message)
        if self._upload is not None and self._upload.sender != sender:
            self._ack(sender, items.DENIED, plan_type)
            return
        if self._rules.in_place:
            self._upload = None  # the same sender begins again, or does not get so far
        capacity = self._rules.capacity[plan_type]
        if message.count > capacity:
            self._ack(sender, items.NO_SPACE, plan_type)
            text = self._rules.too_many_text.format(capacity=capacity)
            self._vehicle.say(Severity.WARNING, text)
            return
        if self._in_place(plan_type):
            self._truncate(plan_type, message.count)
        now_us = self._now_us
        self._upload = _Upload(sender, plan_type, 0, message.count, [], now_us, now_us)
        self._ask_or_end(self._upload)

    def _in_place(self, plan_type: PlanType) -> bool:
        """Whether items are stored as they come; a fence is not, with either firmware."""
        return self._rules.in_place and plan_type is not PlanType.FENCE

    def _truncate(self, plan_type: PlanType, count: int) -> None:
        plan = self._vehicle.plans.of(plan_type)
        if count < len(plan.items):
            plan.replace(plan.items[:count])
            self._changed(plan_type)

    def _on_write_partial_list(self, message: Message) -> None:
        plan_type, sender = PlanType(message.mission_type), sender_of(message)
        first, last = message.start_index, message.end_index
        if not self._rules.in_place:
            self._ack(sender, items.UNSUPPORTED, plan_type)
            return
        if self._upload is not None or plan_type is PlanType.FENCE:
            self._ack(sender, items.DENIED, plan_type)
            return
        stored = self._vehicle.plans.of(plan_type).items
        if not 0 <= first <= last < len(stored):
            self._ack(sender, items.ERROR, plan_type)
            self._vehicle.say(Severity.WARNING, "Flight plan update rejected")
            return
        now_us = self._now_us
        self._upload = _Upload(
            sender, plan_type, first, last + 1, [], now_us, now_us, None, first,
            tuple(stored[last + 1 :]),
        )  # fmt: skip
        self._ask(self._upload)

    def _ask(self, upload: _Upload) -> None:
        upload.asked_us = self._now_us
        make = dialect.MAVLink_mission_request_message
        if self._rules.asks_for_int:
            make = dialect.MAVLink_mission_request_int_message
        self._send(make(*upload.sender, upload.place, upload.plan_type))

    def _ask_or_end(self, upload: _Upload) -> None:
        if upload.place < upload.end:
            self._ask(upload)
            return
        self._upload = None
        result = items.OK
        plan = self._vehicle.plans.of(upload.plan_type)
        taken = [*plan.items[: upload.first], *upload.taken, *upload.kept]
        if upload.plan_type == PlanType.FENCE and self._rules.by_frame is None:
            fault = fence_fault(taken)
            if fault is not None:
                result = items.ERROR
                for text in (fault, "Fence validation failed"):
                    self._vehicle.say(Severity.WARNING, text)
        if result == items.OK and not self._in_place(upload.plan_type):
            plan.replace(taken, items.identity(taken))
            if upload.plan_type == PlanType.MISSION:
                self._vehicle.plans.keep_place(upload.current)
            self._changed(upload.plan_type)
        self._ack(upload.sender, result, upload.plan_type)
        done = result == items.OK and upload.plan_type == PlanType.MISSION
        if done and self._rules.received_text:
            self._vehicle.say(Severity.INFO, self._rules.received_text)

    def _on_item(self, message: Message) -> None:
        if message.current in (_GUIDED_TARGET, _GUIDED_HEIGHT):
            self._on_guided_target(message)
            return
        upload, sender = self._upload, sender_of(message)
        plan_type = PlanType(message.mission_type)
        if upload is None or upload.plan_type != plan_type:
            self._ack(sender, items.ERROR, plan_type)
            return
        if upload.sender != sender:
            self._ack(sender, items.DENIED, plan_type)
            return
        if message.seq != upload.place:
            # The answer to a question that was asked twice is no mistake of the sender.
            if message.seq == upload.place - 1:
                self._ask(upload)
            else:
                self._ack(sender, items.INVALID_SEQUENCE, plan_type)
            return
        if message.current:
            upload.current = message.seq
        self._take(upload, items.from_message(message))

    def _take(self, upload: _Upload, item: PlanItem) -> None:
        is_home = (
            self._rules.home_first and upload.plan_type == PlanType.MISSION and upload.place == 0
        )
        if is_home:
            item = PlanItem(Cmd.WAYPOINT, 0)
        result = items.fault(item, upload.plan_type, self._rules)
        if result != items.OK:
            self._upload = None
            self._ack(upload.sender, result, upload.plan_type)
            if self._rules.bad_item_text:
                self._vehicle.say(Severity.CRITICAL, self._rules.bad_item_text)
            return
        item = items.stored(item, self._rules)
        upload.heard_us = self._now_us
        if self._in_place(upload.plan_type):
            self._vehicle.plans.of(upload.plan_type).put(upload.place, item)
            self._changed(upload.plan_type)
        else:
            upload.taken.append(item)
        upload.place += 1
        self._ask_or_end(upload)

    def _on_guided_target(self, message: Message) -> None:
        """MISSION_ITEM with current = 2 or 3: fly there or at that height, in GUIDED."""
        item = items.from_message(message)
        if message.current == _GUIDED_TARGET:
            result = self._vehicle.fly_to_item(item)
        else:
            result = self._vehicle.fly_at_height_of(item)
        self._ack(
            sender_of(message),
            items.OK if result is Result.ACCEPTED else items.ERROR,
            PlanType.MISSION,
        )

    # Clearing, current item.

    def _on_clear_all(self, message: Message) -> None:
        wanted, sender = message.mission_type, sender_of(message)
        result = items.OK
        for plan_type in PlanType:
            if wanted not in (plan_type, ALL_TYPES):
                continue
            if plan_type == PlanType.MISSION and self._rules.locked_in_auto and self._in_auto():
                result = items.ERROR
                continue
            upload = self._upload
            if upload is not None and upload.plan_type == plan_type:
                if self._rules.in_place and upload.sender != sender:
                    self._ack(sender, items.DENIED, plan_type)
                    result = items.ERROR  # the real one answers twice
                    continue
                self._upload = None
            self._vehicle.plans.of(plan_type).replace([])
            if plan_type == PlanType.MISSION:
                self._vehicle.plans.forget_progress()
            self._changed(plan_type)
        self._ack(sender, result, wanted)

    def _in_auto(self) -> bool:
        return self._vehicle.armed and self._vehicle.mode is self._vehicle.auto

    def _on_set_current(self, message: Message) -> None:
        result = self._vehicle.auto.set_current(message.seq)
        if result is not Result.ACCEPTED and self._rules.not_in_list_text:
            self._vehicle.say(Severity.CRITICAL, self._rules.not_in_list_text)
        self._send_later(_MISSION_CURRENT)

    # Effects of a changed list.

    def _changed(self, plan_type: PlanType) -> None:
        plans, saved = self._vehicle.plans, self._vehicle.saved
        if plan_type == PlanType.MISSION:
            saved.mission_length(len(plans.mission.items))
            self._vehicle.auto.mission_changed()
        elif plan_type == PlanType.RALLY:
            saved.rally_length(len(plans.rally.items))
        elif self._rules.in_place:
            self._vehicle.say(Severity.DEBUG, "Fence Indexed OK")
            saved.fence_length(fence_total(plans.fence.items))
