"""Tools of an agent: their schemas, and what a call does. No ROS, no clock, no transport."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol, TypeVar

from drone_navigation.agents.acts import ACTS, AgentAct
from drone_navigation.agents.proposals import (
    AgentProposal,
    Judgement,
    ProposalBook,
    ProposalState,
    ToolRejection,
)
from navigation_bridge.configuration.checked_values import (
    FLAG,
    InvalidValueError,
    Kind,
    Schema,
    member,
    number,
    record,
    text,
)
from navigation_core.geometry import Vector3

__all__ = ["AgentHands", "AgentTool", "ToolCalls", "ToolReply", "tools"]

_Arguments = TypeVar("_Arguments")
_CONFIRM = "A person confirms it with: navigation_mcp confirm {}"
_LOOK_S = 0.2


class AgentHands(Protocol):
    """The vehicle, as the tools reach it."""

    async def rehearse(self, act: AgentAct) -> Judgement:
        """Rehearse an act, without moving anything; within a limit of time."""

    def fly(self, proposal: AgentProposal) -> None:
        """Begin what was released."""

    async def draw(self, proposal: AgentProposal) -> Path:
        """Draw the rehearsed flight of a proposal; return the PNG file. Raises ToolRejection."""

    async def report(self) -> object:
        """Return the report of the newest recording, for JSON. Raises ToolRejection."""

    async def hold(self) -> None:
        """Hold now. Raises ToolRejection."""

    def read(self, name: str) -> object:
        """Return the state of the vehicle, or another value, for JSON. Raises ToolRejection."""

    @property
    def position_enu_m(self) -> Vector3 | None:
        """Where the vehicle is; None while unknown."""

    @property
    def is_flying(self) -> bool:
        """Whether it is armed and off the ground."""

    async def pause(self, seconds: float) -> float:
        """Let others work for some time; return the time then, s."""


@dataclass(frozen=True)
class ToolReply:
    """Answer to a call.

    Attributes:
        value: for JSON.
        rejected: whether the call was rejected.
        picture: a PNG file to show, or None.
    """

    value: Mapping[str, object]
    rejected: bool = False
    picture: Path | None = None


@dataclass(frozen=True)
class AgentTool:
    """A tool as an agent sees it.

    Attributes:
        name: its name.
        description: sentences.
        schema: JSON Schema of its arguments.
        moves: whether it leads to a motion, once that is confirmed.
    """

    name: str
    description: str
    schema: Schema
    moves: bool


@dataclass(frozen=True)
class _NoArguments:
    """None."""


@dataclass(frozen=True)
class _ProposalQuestion:
    id: str = member(text(100), text="of the proposal")
    wait_s: float = member(number(0, 60), text="s to wait for a change of its state", default=0.0)


@dataclass(frozen=True)
class _PictureQuestion:
    id: str = member(text(100), text="of the proposal")
    image: bool = member(FLAG, text="whether the answer has the image, too", default=True)


_NOTHING: Kind[_NoArguments] = record(_NoArguments)
_QUESTION: Kind[_ProposalQuestion] = record(_ProposalQuestion)
_PICTURE: Kind[_PictureQuestion] = record(_PictureQuestion)
_READ = {
    "state": "Mode, armed, battery, position in m in the map (east, north, up), and so on.",
    "obstacles": "Known and sensed obstacles, in m in the map: posts as x, y, radius, bottom, top; "
    "boxes as x, y, half length, half width, yaw (rad), bottom, top.",
    "bounds": "Flight volume and fence, in m in the map, heights above home; and the envelope that "
    "no proposal may leave.",
    "report": "Report of the newest recording: distance, heights, speed, battery, tracking errors, "
    "goals with their codes, warnings; units stand in the names, times are s from its beginning.",
    "events": "The last goals of all clients: accepted, rejected and ended, with codes.",
}
_MOVES = {
    "takeoff": "Propose to arm and take off.",
    "land": "Propose to land where the vehicle is.",
    "return": "Propose to return to the launch point.",
    "goto": "Propose to fly to a position.",
    "route": "Propose to fly a route.",
    "orbit": "Propose to fly a circle.",
}
_PROPOSES = (
    " Nothing moves: the act is checked and rehearsed, and waits for a person, unless the rules of "
    "this agent allow it. The result has the id of the proposal."
)


def tools() -> list[AgentTool]:
    """Return all tools."""
    found = [AgentTool(n, text_, _NOTHING.schema, False) for n, text_ in _READ.items()]
    found += [AgentTool(n, t + _PROPOSES, ACTS[n].schema, True) for n, t in _MOVES.items()]
    return [
        *found,
        AgentTool("proposals", "All proposals of this session.", _NOTHING.schema, False),
        AgentTool("proposal", "State and end of a proposal.", _QUESTION.schema, False),
        AgentTool(
            "picture",
            "Picture of the flight that was rehearsed for a proposal, as a PNG file: path, "
            "obstacles, fence and flight volume.",
            _PICTURE.schema,
            False,
        ),
        AgentTool(
            "hold",
            "End the goal, whoever has sent it, and hold the position now. Always allowed.",
            _NOTHING.schema,
            True,
        ),
    ]


class ToolCalls:
    """Calls of one agent, and the confirmations of its proposals."""

    def __init__(self, book: ProposalBook, hands: AgentHands) -> None:
        """Serve with these."""
        self._book = book
        self._hands = hands

    async def call(self, name: str, arguments: object, now: float) -> ToolReply:
        """Serve a call.

        Args:
            name: of the tool.
            arguments: as the agent sent them.
            now: time, s.
        """
        try:
            if name == "hold":  # whatever its arguments are
                await self._hands.hold()
                return ToolReply({"message": "The vehicle holds."})
            self._book.count_call(now)
            if name == "picture":
                return await self._picture(_read(_PICTURE, arguments), now)
            return ToolReply(await self._serve(name, arguments, now))
        except ToolRejection as error:
            about = {"code": error.code, "message": error.message}
            return ToolReply({"rejected": {**about, "accepted": error.accepted}}, True)

    async def _serve(self, name: str, arguments: object, now: float) -> Mapping[str, object]:
        if name in ACTS:
            return await self._propose(_read(ACTS[name], arguments), now)
        if name == "proposal":
            return await self._look(_read(_QUESTION, arguments), now)
        if name in ("proposals", *_READ):
            _read(_NOTHING, arguments)
            if name == "proposals":
                return {"proposals": [each.value() for each in self._book.all(now)]}
            if name == "report":
                return {name: await self._hands.report()}
            return {name: self._bounds() if name == "bounds" else self._hands.read(name)}
        names = [tool.name for tool in tools()]
        raise ToolRejection("INVALID_ARGUMENTS", "There is no such tool.", {"tools": names})

    async def _propose(self, act: AgentAct, now: float) -> Mapping[str, object]:
        proposal = self._book.propose(act, now)
        judgement = Judgement("INTERNAL_ERROR", "The rehearsal was given up.")
        try:
            judgement = await self._hands.rehearse(act)
        finally:
            released = self._book.judge(proposal, judgement)
        if released:
            self._hands.fly(proposal)
        elif proposal.state is ProposalState.REJECTED:
            raise ToolRejection(proposal.code, proposal.message, self._bounds())
        waits = proposal.state is ProposalState.WAITING
        return {**proposal.value(), "next": _CONFIRM.format(proposal.id) if waits else ""}

    def _bounds(self) -> Mapping[str, object]:
        """Return what a flight must stay within, as far as it is known."""
        return {"vehicle": self._hands.read("bounds"), "agent": self._book.limits()}

    async def _look(self, asked: _ProposalQuestion, now: float) -> Mapping[str, object]:
        proposal = self._book.get(asked.id, now)
        state, until_s = proposal.state, now + asked.wait_s
        while proposal.state is state and now < until_s:
            now = await self._hands.pause(_LOOK_S)
            self._book.all(now)
        return proposal.value()

    async def _picture(self, asked: _PictureQuestion, now: float) -> ToolReply:
        picture = await self._hands.draw(self._book.get(asked.id, now))
        return ToolReply({"picture": str(picture)}, picture=picture if asked.image else None)

    # --- the person ----------------------------------------------------------------------

    def waiting(self, now: float) -> list[Mapping[str, object]]:
        """Return the proposals that wait, with the agent's name, for a person."""
        found = [each for each in self._book.all(now) if each.state is ProposalState.WAITING]
        return [
            {
                **each.value(),
                "agent": self._book.agent,
                "envelope": each.judgement.extent.sentence
                if each.judgement and each.judgement.extent
                else f"not rehearsed: {each.judgement.message if each.judgement else ''}",
            }
            for each in found
        ]

    def confirm(self, proposal_id: str, by: str, now: float) -> None:
        """Release a proposal and fly it.

        Raises:
            ToolRejection: it does not wait any more.
        """
        position, is_flying = self._hands.position_enu_m, self._hands.is_flying
        self._hands.fly(self._book.confirm(proposal_id, by, position, is_flying, now))

    async def picture(self, proposal_id: str, now: float) -> Path:
        """Return the picture of a proposal, a PNG file.

        Raises:
            ToolRejection: there is none.
        """
        return await self._hands.draw(self._book.get(proposal_id, now))

    def reject(self, proposal_id: str, by: str, now: float) -> None:
        """Reject a proposal.

        Raises:
            ToolRejection: it does not wait any more.
        """
        self._book.reject(proposal_id, by, now)


def _read(kind: Kind[_Arguments], arguments: object) -> _Arguments:
    try:
        return kind.read({} if arguments is None else arguments)
    except InvalidValueError as error:
        raise ToolRejection("INVALID_ARGUMENTS", str(error), kind.schema) from None
    except RecursionError:
        text_ = "The arguments are nested too deep."
        raise ToolRejection("INVALID_ARGUMENTS", text_, kind.schema) from None
