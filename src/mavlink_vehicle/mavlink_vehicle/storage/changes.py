"""Reads or changes parameters one after the other; many of them after a reading of all."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping

from mavlink_vehicle.codec import Message
from mavlink_vehicle.events import (
    OperationResult,
    Parameter,
    ParameterChange,
    ParameterOutcome,
    ParametersFinished,
)
from mavlink_vehicle.protocols.operations.command import Address
from mavlink_vehicle.protocols.outbox import Outbox
from mavlink_vehicle.storage.listing import ParameterListing
from mavlink_vehicle.storage.one_parameter import OneParameter

# Parameters that ArduPilot and PX4 maintain themselves: boots, times, and items of their lists. A
# file saved earlier would take hours of flight back, or bring another vehicle's. Another version
# of the stored format has all parameters erased at the next boot (load_parameters, rcS).
_MAINTAINED_BY_AUTOPILOT = (
    "STAT_BOOTCNT", "STAT_FLTTIME", "STAT_RUNTIME", "MIS_TOTAL", "FENCE_TOTAL", "RALLY_TOTAL",
    "COM_FLIGHT_UUID", "LND_FLIGHT_T_HI", "LND_FLIGHT_T_LO", "FORMAT_VERSION", "SYSID_SW_MREV",
    "SYS_NUM_RESETS", "LOG_LASTFILE", "SYS_PARAM_VER",
)  # fmt: skip

_DONE = (ParameterChange.READ, ParameterChange.CHANGED, ParameterChange.UNCHANGED)


class ParameterChanges(Outbox):
    """Parameters that are to have values; ends in one `ParametersFinished`.

    With a reading of all before, only what differs is asked for, and what the autopilot maintains
    itself stays. A name that the complete list lacks is unknown, without a question about it. Some
    exist only once others are set (ArduPilot's _ENABLE and _TYPE), so all are read again while
    something has changed and names are unknown. Names that an incomplete list lacks are read one
    by one.
    """

    def __init__(
        self,
        wanted: Mapping[str, float | None],
        address: Address,
        bytewise: bool,
        objection: Callable[[], str | None],
        list_first: bool = False,
    ) -> None:
        """Prepare; `start` sends.

        Args:
            wanted: the values by name; None to read.
            address: who talks with whom.
            bytewise: whether integers stand in the float as their bytes.
            objection: asked before each change: why there must be no more, as part of a sentence.
            list_first: whether all are read first.
        """
        super().__init__()
        self._wanted = dict(wanted)
        self._address = address
        self._bytewise = bytewise
        self._objection = objection
        self._listing = ParameterListing(address, bytewise) if list_first else None
        self._known: dict[str, Parameter] = {}
        self._is_complete = False
        self._left: deque[str] = deque(self._wanted)
        self._unknown: list[str] = []
        self._has_changed = False
        self._one: OneParameter | None = None
        self._outcomes: dict[str, ParameterOutcome] = {}
        self.events: deque[ParametersFinished] = deque()

    @property
    def progress(self) -> tuple[bool, int, int]:
        """Whether parameters are changed by now, how many are done, and of how many."""
        if self._listing is not None:
            return False, self._listing.received, self._listing.total
        return True, len(self._outcomes), len(self._wanted)

    def start(self, now: float) -> None:
        """Read all, or begin with the first."""
        if self._listing is None:
            self._next(now)
            return
        self._listing.start(now)
        self.outbox += self._listing.messages_to_send()

    def receive(self, message: Message, now: float) -> None:
        """Process a message of the parameter service."""
        if self._listing is not None:
            self._listing.receive(message, now)
        elif self._one is not None:
            self._one.receive(message, now)
        self._go_on(now)

    @property
    def deadline_s(self) -> float | None:
        """When to continue."""
        part = self._listing or self._one
        return None if part is None else part.deadline_s

    def handle_timer(self, now: float) -> None:
        """Ask again."""
        part = self._listing or self._one
        if part is not None:
            part.handle_timer(now)
            self._go_on(now)

    def next_event(self) -> ParametersFinished | None:
        """Return and remove the end."""
        return self.events.popleft() if self.events else None

    def stop(self, result: OperationResult, reason: str, now: float) -> None:
        """End it for this reason; changes made until then stay."""
        if self.events or (self._listing is None and self._one is None):
            return
        if self._one is not None:
            outcome = self._one.stop(reason)
            self._outcomes[outcome.name] = outcome
        self._give_up(result, reason)

    def _go_on(self, now: float) -> None:
        """Take what has ended."""
        if self._listing is not None:
            self.outbox += self._listing.messages_to_send()
            end = self._listing.next_event()
            if end is not None:
                self._listing = None
                self._known |= {parameter.name: parameter for parameter in end.parameters}
                self._is_complete = end.result is OperationResult.ACHIEVED
                if self._known:
                    self._next(now)
                else:
                    self._give_up(end.result, "the autopilot does not answer")
        elif self._one is not None:
            self.outbox += self._one.messages_to_send()
            if self._one.outcome is not None:
                self._put(self._one.outcome)
                self._next(now)

    def _put(self, outcome: ParameterOutcome) -> None:
        self._outcomes[outcome.name] = outcome
        if outcome.change is ParameterChange.CHANGED:
            self._has_changed = True
        elif outcome.change is ParameterChange.UNKNOWN:
            self._unknown.append(outcome.name)

    def _next(self, now: float) -> None:
        """Begin with the next; those that need no message are done at once."""
        while True:
            self._one = None
            if not self._left and self._unknown and self._has_changed:
                self._list_again(now)
                return
            if not self._left:
                self._finish()
                return
            name = self._left.popleft()
            wanted = self._wanted[name]
            if name in _MAINTAINED_BY_AUTOPILOT and name in self._known:
                text = f"{name} stays as it is: the autopilot maintains it."
                known = self._known[name]
                self._put(ParameterOutcome(name, ParameterChange.UNCHANGED, text, known, known))
                continue
            if name not in self._known and (self._is_complete or name in self._outcomes):
                text = f"{name} is unknown to the autopilot: it is not in its list."
                self._put(ParameterOutcome(name, ParameterChange.UNKNOWN, text))
                continue
            objection = None if wanted is None else self._objection()
            if objection is not None:
                self._left.appendleft(name)
                self._give_up(OperationResult.REFUSED, objection)
                return
            self._one = OneParameter(
                name, wanted, self._address, self._bytewise, self._known.get(name)
            )
            self._one.start(now)
            self.outbox += self._one.messages_to_send()
            if self._one.outcome is None:
                return
            self._put(self._one.outcome)

    def _list_again(self, now: float) -> None:
        """Read all again, and try the names that were unknown."""
        self._left.extend(self._unknown)
        self._unknown.clear()
        self._has_changed = self._is_complete = False
        self._listing = ParameterListing(self._address, self._bytewise)
        self._listing.start(now)
        self.outbox += self._listing.messages_to_send()

    def _give_up(self, result: OperationResult, reason: str) -> None:
        self._listing = self._one = None
        for name in self._left:
            if name not in self._outcomes:
                text = f"{name} was not {self._verb(name)}: {reason}."
                self._outcomes[name] = ParameterOutcome(name, ParameterChange.FAILED, text)
        self._left.clear()
        self._finish(result, f" Ended early: {reason}.")

    def _verb(self, name: str) -> str:
        return "read" if self._wanted[name] is None else "changed"

    def _finish(self, result: OperationResult | None = None, why: str = "") -> None:
        outcomes = tuple(self._outcomes[name] for name in self._wanted)
        if result is None:
            done = all(outcome.change in _DONE for outcome in outcomes)
            result = OperationResult.ACHIEVED if done else OperationResult.REFUSED
        if len(outcomes) == 1:
            reason = outcomes[0].reason
        else:
            count = dict.fromkeys(ParameterChange, 0)
            for outcome in outcomes:
                count[outcome.change] += 1
            reason = (
                f"{len(outcomes)} parameters: {count[ParameterChange.CHANGED]} changed, "
                f"{count[ParameterChange.UNCHANGED]} unchanged, "
                f"{count[ParameterChange.UNKNOWN]} unknown to the autopilot, "
                f"{count[ParameterChange.FAILED]} failed.{why}"
            )
        self.events.append(ParametersFinished(result, reason, outcomes=outcomes))
