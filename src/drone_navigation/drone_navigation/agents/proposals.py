"""Proposals of one agent, from their making to their end. No I/O; time is an argument.

A proposal is released to be flown in two ways only: by `confirm`, which a person's terminal calls,
and by `judge`, for an act that the rules allow within its envelope, in a vehicle that flies.
"""

from __future__ import annotations

import itertools
from collections import deque
from dataclasses import dataclass, field, replace
from enum import Enum

from drone_navigation.agents.acts import AgentAct
from drone_navigation.agents.envelopes import FlightExtent, breaches
from drone_navigation.agents.rules import AgentRules
from flight_reports.planned_flight import PlannedFlight
from navigation_core.geometry import Vector3, distance

__all__ = ["AgentProposal", "Judgement", "ProposalBook", "ProposalState", "ToolRejection"]

WAITS_S = 300.0
"""A proposal that nobody confirms is given up after this time"""
MOVED_MAX_M = 3.0
"""Of the vehicle, from where a flight was rehearsed"""
_LOWERING = ("land", "return")
"""They end a flight: whatever they leave, a person may confirm them"""
_GROUNDED = ("takeoff", *_LOWERING)
"""They begin or end on the ground: a lowest height is not about them"""
_KEPT = 50
_MINUTE_S = 60.0


class ProposalState(Enum):
    """State of a proposal."""

    REHEARSING = "rehearsing"
    WAITING = "waiting for a person"
    FLYING = "flying"
    ENDED = "ended"
    REJECTED = "rejected"
    EXPIRED = "expired"


@dataclass(frozen=True)
class ToolRejection(Exception):  # noqa: N818 - as the field's term has it
    """A tool call that does nothing.

    Attributes:
        code: of GoalCode.msg, or INVALID_ARGUMENTS, RATE_LIMIT, UNKNOWN_PROPOSAL, NOT_WAITING,
            OUTSIDE_ENVELOPE, VEHICLE_MOVED, NO_PICTURE, NO_RECORDING.
        message: a sentence.
        accepted: what would be accepted, for JSON; None if that is not known.
    """

    code: str
    message: str
    accepted: object = None


@dataclass(frozen=True)
class Judgement:
    """Result of a rehearsal.

    Attributes:
        code: SUCCESS, or why the act would be rejected or fail; empty if it was not rehearsed.
        message: a sentence; for what was not rehearsed, why.
        extent: of the flight, if it was rehearsed.
        position_enu_m: where it begins.
        is_flying: whether the vehicle is armed and off the ground.
        scene: of the flight, for its picture, if it was rehearsed.
    """

    code: str
    message: str
    extent: FlightExtent | None = None
    position_enu_m: Vector3 | None = None
    is_flying: bool = False
    scene: PlannedFlight | None = None


@dataclass
class AgentProposal:
    """A proposal; only the book writes it.

    Attributes:
        id: by which it is confirmed.
        act: what is proposed.
        made_s: when.
        state: as of now.
        judgement: of its rehearsal.
        released_by: the person, or "the rules"; empty before.
        code: of its end or rejection.
        message: a sentence on that.
    """

    id: str
    act: AgentAct
    made_s: float
    state: ProposalState = ProposalState.REHEARSING
    judgement: Judgement | None = None
    released_by: str = ""
    code: str = ""
    message: str = ""
    history: list[ProposalState] = field(default_factory=list)

    @property
    def arms(self) -> bool:
        """Whether the vehicle would be armed and leave the ground for it."""
        starts = self.act.kind not in _LOWERING
        return starts and not (self.judgement is not None and self.judgement.is_flying)

    def value(self) -> dict[str, object]:
        """Return it for JSON."""
        extent = self.judgement.extent if self.judgement else None
        return {
            "id": self.id,
            "act": self.act.sentence,
            "state": self.state.value,
            "arms_and_takes_off": self.arms,
            "rehearsal": extent.value() if extent else None,
            "rehearsed": self.judgement.message if self.judgement else "",
            "released_by": self.released_by,
            "code": self.code,
            "message": self.message,
        }


class ProposalBook:
    """All proposals of one agent."""

    def __init__(self, agent: str, rules: AgentRules, session: str) -> None:
        """Begin without any.

        Args:
            agent: its name.
            rules: its rules.
            session: letters that another process of the agent would not have.
        """
        self.agent = agent
        self._rules = rules
        self._session = session
        self._numbers = itertools.count(1)
        self._proposals: dict[str, AgentProposal] = {}
        self._calls: deque[float] = deque()

    def count_call(self, now: float) -> None:
        """Count a call of a tool.

        Raises:
            ToolRejection: there were too many in the last minute.
        """
        while self._calls and self._calls[0] <= now - _MINUTE_S:
            self._calls.popleft()
        most = self._rules.calls_per_minute
        if len(self._calls) >= most:
            wait_s = self._calls[0] + _MINUTE_S - now
            raise ToolRejection(
                "RATE_LIMIT",
                f"More than {most:g} calls in a minute; only hold is taken now.",
                {"calls_per_minute": most, "next_call_in_s": round(wait_s, 1)},
            )
        self._calls.append(now)

    def propose(self, act: AgentAct, now: float) -> AgentProposal:
        """Add a proposal, which is to be rehearsed.

        Raises:
            ToolRejection: too many wait already.
        """
        self._expire(now)
        open_ = (ProposalState.REHEARSING, ProposalState.WAITING)
        waiting = [each.id for each in self._proposals.values() if each.state in open_]
        if len(waiting) >= self._rules.waiting_max:
            raise ToolRejection(
                "BUSY",
                f"{len(waiting)} proposals wait for a person: {', '.join(waiting)}.",
                {"waiting_max": self._rules.waiting_max},
            )
        proposal = AgentProposal(f"{self.agent}-{self._session}-{next(self._numbers)}", act, now)
        self._proposals[proposal.id] = proposal
        while len(self._proposals) > _KEPT:
            over = [each for each in self._proposals.values() if each.state not in open_]
            del self._proposals[over[0].id]
        return proposal

    def judge(self, proposal: AgentProposal, judgement: Judgement) -> bool:
        """Take the result of a rehearsal; return whether the proposal is released by the rules."""
        if proposal.state is not ProposalState.REHEARSING:
            return False
        proposal.judgement = judgement
        kind, extent = proposal.act.kind, judgement.extent
        if extent and kind in _GROUNDED:
            extent = replace(extent, height_min_m=extent.height_max_m)
        if judgement.code not in ("", "SUCCESS"):
            self._move(proposal, ProposalState.REJECTED, judgement.code, judgement.message)
            return False
        limits, text = self._rules.envelope, ""
        beyond = breaches(extent, limits) if extent and limits else ()
        if limits and not extent:
            beyond = (f"it is unknown. {judgement.message}",)
        if beyond:
            text = f"The flight would leave the agent's envelope: {', '.join(beyond)}."
        if beyond and kind not in _LOWERING:
            self._move(proposal, ProposalState.REJECTED, "OUTSIDE_ENVELOPE", text)
            return False
        self._move(proposal, ProposalState.WAITING, "", text)
        allowed = self._rules.allow.get(kind)
        if allowed is None or extent is None or not judgement.is_flying:
            return False
        if why := breaches(extent, allowed):
            proposal.message = f"A person must confirm it: {', '.join(why)}."
            return False
        self._release(proposal, "the rules")
        return True

    def confirm(
        self,
        proposal_id: str,
        by: str,
        position_enu_m: Vector3 | None,
        is_flying: bool,
        now: float,
    ) -> AgentProposal:
        """Release a proposal, for a person.

        Args:
            proposal_id: its id.
            by: who confirms.
            position_enu_m: where the vehicle is; None while unknown.
            is_flying: whether it is armed and off the ground.
            now: time, s.

        Raises:
            ToolRejection: it does not wait, or the vehicle is not as it was when it was proposed.
        """
        proposal = self._waiting(proposal_id, now)
        judged = proposal.judgement
        start = judged.position_enu_m if judged else None
        moved = start is not None and (
            position_enu_m is None or distance(start, position_enu_m) > MOVED_MAX_M
        )
        if moved or (judged is not None and judged.is_flying is not is_flying):
            text = (
                "The vehicle has moved, taken off or landed since the proposal; propose it again."
            )
            self._move(proposal, ProposalState.EXPIRED, "VEHICLE_MOVED", text)
            raise ToolRejection("VEHICLE_MOVED", text, {"moved_max_m": MOVED_MAX_M})
        self._release(proposal, by)
        return proposal

    def reject(self, proposal_id: str, by: str, now: float) -> AgentProposal:
        """Reject a proposal, for a person.

        Raises:
            ToolRejection: it does not wait.
        """
        proposal = self._waiting(proposal_id, now)
        self._move(proposal, ProposalState.REJECTED, "REJECTED", f"Rejected by {by}.")
        return proposal

    def finish(self, proposal: AgentProposal, code: str, message: str) -> None:
        """Take the end of a flight."""
        self._move(proposal, ProposalState.ENDED, code, message)

    def get(self, proposal_id: str, now: float) -> AgentProposal:
        """Return a proposal.

        Raises:
            ToolRejection: there is none with that id.
        """
        self._expire(now)
        if proposal_id not in self._proposals:
            known = list(self._proposals)[-5:]
            raise ToolRejection("UNKNOWN_PROPOSAL", "No proposal has that id.", {"ids": known})
        return self._proposals[proposal_id]

    def limits(self) -> dict[str, float] | None:
        """Return the envelope that no proposal may leave, for JSON; None without one."""
        limits = self._rules.envelope
        return None if limits is None else limits.value()

    def all(self, now: float) -> list[AgentProposal]:
        """Return all that are kept, the oldest first."""
        self._expire(now)
        return list(self._proposals.values())

    def _waiting(self, proposal_id: str, now: float) -> AgentProposal:
        proposal = self.get(proposal_id, now)
        if proposal.state is not ProposalState.WAITING:
            raise ToolRejection("NOT_WAITING", f"The proposal is {proposal.state.value}.")
        return proposal

    def _release(self, proposal: AgentProposal, by: str) -> None:
        proposal.released_by = by
        self._move(proposal, ProposalState.FLYING)

    def _expire(self, now: float) -> None:
        for each in self._proposals.values():
            if each.state is ProposalState.WAITING and now > each.made_s + WAITS_S:
                text = f"Nobody confirmed it within {WAITS_S:g} s."
                self._move(each, ProposalState.EXPIRED, "TIMEOUT", text)

    @staticmethod
    def _move(
        proposal: AgentProposal, state: ProposalState, code: str = "", message: str = ""
    ) -> None:
        proposal.history.append(proposal.state)
        proposal.state, proposal.code, proposal.message = state, code, message
