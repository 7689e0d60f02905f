"""Several isolated vehicles on one driver thread. No ROS.

The driver runs a :class:`FleetApplication`. It passes each message to its vehicle, calls each
vehicle at its deadline, and collects messages only from vehicles with events. An exception of one
vehicle's application ends that vehicle's goal. When its timers fail repeatedly, the fleet gives the
vehicle up: nothing more is sent to it, so that its own failsafe acts. The others are not affected.
"""

from __future__ import annotations

import logging
import math
from collections.abc import Callable, Sequence
from functools import partial
from operator import attrgetter
from typing import Protocol, TypeVar

from mavlink_vehicle.codec import Intake, Message
from mavlink_vehicle.errors import DriverError
from mavlink_vehicle.io.clock import Clock
from mavlink_vehicle.io.driver import PAUSE_S, Application, Patience, TakesMeasurements
from mavlink_vehicle.io.endpoints import TokenBucket

__all__ = ["DriverThread", "FleetApplication", "Member", "MemberApplication"]

ResultT = TypeVar("ResultT")

VEHICLE_MESSAGES_HZ, VEHICLE_BURST = 1000.0, 2000.0
"""Message rate limit of one of several vehicles: ten times its telemetry."""
# Asked for all members in each turn of the driver.
_DEADLINE_S = attrgetter("deadline_s")


class DriverThread(Protocol):
    """Queue of work for the driver thread: a driver, or a member of a fleet."""

    def post(self, work: Callable[[], object]) -> None:
        """Run ``work`` there, soon."""

    def call(self, work: Callable[[], ResultT], timeout_s: float = ...) -> ResultT:
        """Run ``work`` there and return its result; raises what it raises, or DriverError."""


class MemberApplication(Application, Protocol):
    """Application of one vehicle. All methods are called on the driver's thread."""

    def fail(self, error: Exception, now: float) -> None:
        """End the active goal after an internal error."""

    def give_up(self, error: Exception) -> None:
        """End all goals; this application is not called again."""


class Member:
    """One vehicle of a fleet; accepts work for its application from other threads.

    Attributes:
        name: for people.
        system_id: MAVLink system of the vehicle; 0: the first autopilot heard.
        application: the application that runs it.
        given_up: whether it has failed for too long.
        throttled: number of its messages dropped by the rate limit.
    """

    def __init__(self, name: str, system_id: int, application: MemberApplication) -> None:
        """Create a member for a :class:`FleetApplication`."""
        self.name = name
        self.system_id = system_id
        self.application = application
        self.given_up = False
        self.throttled = 0
        self.bucket = TokenBucket(VEHICLE_MESSAGES_HZ, VEHICLE_BURST)
        self.patience = Patience()
        self.deadline_s = -math.inf
        self.asked_s: float | None = None
        self.handled_s: float | None = None
        self.rests_until_s = -math.inf
        self.timer_worked = False
        self.fleet: FleetApplication | None = None

    def post(self, work: Callable[[], object]) -> None:
        """Run ``work`` on the driver thread, soon; an exception affects this vehicle only."""
        fleet = self._of_fleet()
        fleet.thread.post(lambda: fleet.work(self, work))

    def call(self, work: Callable[[], ResultT], timeout_s: float = 5.0) -> ResultT:
        """Run ``work`` on the driver's thread and return its result; raises what it raises.

        Raises:
            DriverError: the vehicle was given up, or the driver did not respond in time.
        """
        fleet = self._of_fleet()
        if self.given_up:
            raise DriverError("This vehicle was abandoned after repeated internal errors.")

        def touching() -> ResultT:
            fleet.touch(self)
            return work()

        return fleet.thread.call(touching, timeout_s)

    def _of_fleet(self) -> FleetApplication:
        assert self.fleet is not None, "the fleet must take the member in before it accepts work"
        return self.fleet


class FleetApplication:
    """Driver application that runs the applications of several vehicles."""

    def __init__(self, members: Sequence[Member], clock: Clock) -> None:
        """Create a fleet; :meth:`attach` must follow before a member accepts work.

        Args:
            members: at least one; several need distinct system ids.
            clock: the driver's.
        """
        self._members = tuple(members)
        self._clock = clock
        self._thread: DriverThread | None = None
        self._by_system = {member.system_id: member for member in members if member.system_id}
        self._only = self._members[0] if len(self._members) == 1 else None
        # Members with events since their messages and deadlines were last collected.
        self._unsent: dict[Member, None] = {}
        self._untimed: dict[Member, None] = {}
        for member in members:
            member.fleet = self

    def attach(self, thread: DriverThread) -> None:
        """Attach the fleet to the driver whose thread runs it."""
        self._thread = thread

    @property
    def thread(self) -> DriverThread:
        """The queue of work for the members."""
        assert self._thread is not None, "attach comes first"
        return self._thread

    @property
    def lost(self) -> bool:
        """Whether every vehicle was given up."""
        return all(member.given_up for member in self._members)

    # --- called by the driver --------------------------------------------------------------

    def start(self, now: float) -> None:
        """Start all."""
        for member in self._members:
            self.work(member, partial(member.application.start, now))

    def receive(self, message: Message, now: float) -> None:
        """Pass a message to the vehicle that sent it, or that it is addressed to.

        Several vehicles may share one link, as behind another router, so their rates are limited
        here.
        """
        member = self._only or self._member_of(message)
        if member is None:
            return
        if self._is_within_rate(member, now) and not member.given_up:
            self.touch(member)
            try:
                member.application.receive(message, now)
            except Exception as error:
                self._report_failure(member, error)

    def intakes(self, system: int, component: int) -> dict[int, Intake]:
        """Return what takes measurements of a sender straight from their frames, by number."""
        member = self._only or self._by_system.get(system)
        if member is None or not isinstance(member.application, TakesMeasurements):
            return {}
        found = member.application.intakes(system, component)
        return {number: self._guarded(member, intake) for number, intake in found.items()}

    def _guarded(self, member: Member, intake: Intake) -> Intake:
        """Return an intake for a vehicle whose failures affect no other.

        It needs no `touch`: a measurement gives nothing to send, and no nearer deadline.
        """

        def take(data: bytes, now: float) -> bool:
            if not self._is_within_rate(member, now) or member.given_up:
                return True
            try:
                return intake(data, now)
            except Exception as error:
                self._report_failure(member, error)
                return True

        return take

    def _is_within_rate(self, member: Member, now: float) -> bool:
        """Return whether a vehicle sends no more than its share of a link; count it otherwise."""
        if self._only is not None or member.bucket.take(1, now):
            return True
        member.throttled += 1
        return False

    def overhear(self, message: Message, now: float) -> None:
        """Pass a message of a ground station to its target vehicle, or to all."""
        target = getattr(message, "target_system", 0)
        for member in self._members:
            if self._only is None and target not in (0, member.system_id):
                continue
            self.work(member, partial(member.application.overhear, message, now))

    def handle_timer(self, now: float) -> None:
        """Run all due timers, the longest overdue first."""
        due = [member for member in self._members if member.deadline_s <= now]
        for member in sorted(due, key=lambda member: member.deadline_s):
            self.touch(member)
            if member.given_up:
                continue
            member.handled_s = member.asked_s
            member.rests_until_s = now + PAUSE_S
            try:
                member.application.handle_timer(now)
            except Exception as error:
                self._fail(member, error)
            else:
                member.timer_worked = True

    def next_deadline(self) -> float | None:
        """Return the earliest deadline of all members."""
        for member in self._untimed:
            member.deadline_s = self._deadline(member)
        self._untimed.clear()
        deadline_s: float = min(map(_DEADLINE_S, self._members))
        return None if deadline_s == math.inf else max(deadline_s, 0.0)

    def messages_to_send(self) -> list[Message]:
        """Return the messages of the members with events."""
        messages: list[Message] = []
        for member in self._unsent:
            if member.given_up:
                continue
            self._untimed[member] = None
            try:
                messages += member.application.messages_to_send()
            except Exception as error:
                self._fail(member, error)
            else:
                if member.timer_worked:
                    member.patience.worked()
            member.timer_worked = False
        self._unsent.clear()
        return messages

    # --- work for one of them -------------------------------------------------------------

    def touch(self, member: Member) -> None:
        """Mark a vehicle as touched: read its messages and deadline next."""
        self._unsent[member] = self._untimed[member] = None

    def work(self, member: Member, work: Callable[[], object]) -> None:
        """Run something for one vehicle; an exception ends its goal and affects no other."""
        if member.given_up:
            return
        self.touch(member)
        try:
            work()
        except Exception as error:
            self._report_failure(member, error)

    def _member_of(self, message: Message) -> Member | None:
        member = self._by_system.get(message._header.srcSystem)
        if member is not None:
            return member
        return self._by_system.get(getattr(message, "target_system", 0))

    def _deadline(self, member: Member) -> float:
        if member.given_up:
            return math.inf
        try:
            deadline_s = member.application.next_deadline()
        except Exception as error:
            self._fail(member, error)
            return member.rests_until_s
        member.asked_s = deadline_s
        # Neither a failure nor a deadline that does not move may cause a busy loop.
        if member.patience.failing:
            return member.rests_until_s
        if deadline_s is None:
            return math.inf
        if deadline_s == member.handled_s:
            return max(deadline_s, member.rests_until_s)
        return deadline_s

    def _fail(self, member: Member, error: Exception) -> None:
        """Count a failure of essential work: timers, deadlines, messages."""
        self._report_failure(member, error)
        now = self._clock.now()
        if member.rests_until_s <= now:
            member.rests_until_s = now + PAUSE_S
        failing_s = member.patience.fail(now)
        if failing_s is not None:
            member.given_up = True
            member.application.give_up(
                DriverError(
                    f"Vehicle {member.name} has been failing for {failing_s:.1f} s and is "
                    "abandoned; nothing more is sent to it, so that its own failsafe can act."
                )
            )

    def _report_failure(self, member: Member, error: Exception) -> None:
        try:
            member.application.fail(error, self._clock.now())
        except Exception as second:
            logging.getLogger(__name__).error("The report of a failure failed.", exc_info=second)
