"""Whatever an agent calls, only what a person confirmed or the rules allow is flown."""

from __future__ import annotations

import asyncio
import random
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drone_navigation.agents.acts import (
    AgentAct,
    AgentGoto,
    AgentLanding,
    AgentReturn,
    AgentTakeoff,
)
from drone_navigation.agents.envelopes import ActEnvelope, FlightExtent, breaches
from drone_navigation.agents.proposals import (
    AgentProposal,
    Judgement,
    ProposalBook,
    ProposalState,
    ToolRejection,
)
from drone_navigation.agents.rules import AgentRules
from drone_navigation.agents.tool_calls import ToolCalls
from navigation_core.geometry import Vector3
from tests.support.agents import hostile_calls

ENVELOPE = ActEnvelope(30.0, 1.0, 12.0, 5.0, 120.0, 30.0, 2.0)
CODES = ("SUCCESS", "SUCCESS", "SUCCESS", "", "OUTSIDE_VOLUME", "NO_PATH")


class Hands:
    """A vehicle that answers at random and keeps what is flown."""

    def __init__(self, rng: random.Random) -> None:
        self._rng = rng
        self.flown: list[AgentProposal] = []
        self.holds = 0
        self.position_enu_m: Vector3 | None = (0.0, 0.0, 5.0)
        self.is_flying = True

    async def rehearse(self, act: AgentAct) -> Judgement:
        await asyncio.sleep(0)
        rng = self._rng
        code = rng.choice(CODES) if act.kind in ("goto", "route", "orbit") else ""
        extent = None
        if code:
            # Each limit of the envelope below is kept three times out of four.
            extent = FlightExtent(
                rng.choice([10.0, 20.0, 30.0, 31.0]),
                rng.choice([1.0, 2.0, 5.0, 0.9]),
                rng.choice([8.0, 11.0, 12.0, 12.1]),
                rng.choice([1.0, 4.0, 5.0, 5.1]),
                rng.choice([10.0, 50.0, 120.0, 121.0]),
                rng.choice([30.0, 60.0, 90.0, 29.0, None]),
                rng.choice([2.0, 5.0, None, 1.9]),
            )
        return Judgement(code, "as drawn", extent, self.position_enu_m, self.is_flying)

    def fly(self, proposal: AgentProposal) -> None:
        self.flown.append(proposal)

    async def draw(self, proposal: AgentProposal) -> Path:
        if proposal.judgement is None or proposal.judgement.extent is None:
            raise ToolRejection("NO_PICTURE", "The proposal was not rehearsed.")
        return Path(f"{proposal.id}.png")

    async def report(self) -> object:
        return {"flights": []}

    async def hold(self) -> None:
        self.holds += 1

    def read(self, name: str) -> object:
        return {"name": name}

    async def pause(self, seconds: float) -> float:
        await asyncio.sleep(0)
        return 1e9  # as after any wait


def book_with(hands: Hands, **rules: object) -> tuple[ProposalBook, ToolCalls]:
    given_rules = AgentRules("", calls_per_minute=6000.0, **rules)  # type: ignore[arg-type]
    book = ProposalBook("agent", given_rules, "000000")
    return book, ToolCalls(book, hands)


@pytest.mark.parametrize("seed", range(5))
def test_ten_thousand_hostile_calls_move_nothing_that_was_not_confirmed(seed: int) -> None:
    rng = random.Random(seed)
    hands = Hands(rng)
    _, calls = book_with(hands)
    ids: list[str] = []
    confirmed: list[str] = []
    outcomes = {"proposed": 0, "rejected": 0}

    async def play() -> None:
        now = 0.0
        for name, arguments in hostile_calls(rng, 2000, ids):
            now += rng.choice([0.02, 0.02, 0.1, 20.0])
            reply = await calls.call(name, arguments, now)
            outcomes["rejected" if reply.rejected else "proposed"] += 1
            if not reply.rejected and isinstance(reply.value.get("id"), str):
                ids.append(str(reply.value["id"]))
            if ids and rng.random() < 0.05:
                wanted = rng.choice(ids[-3:])
                try:
                    calls.confirm(wanted, "a person", now)
                    confirmed.append(wanted)
                except ToolRejection:
                    pass
            assert [each.id for each in hands.flown] == confirmed

    asyncio.run(play())
    assert len(confirmed) == len(set(confirmed)) > 5
    assert min(outcomes.values()) > 100
    assert hands.holds == 0
    assert all(each.released_by == "a person" for each in hands.flown)


@pytest.mark.parametrize("seed", range(3))
def test_without_a_person_only_acts_within_their_envelope_are_flown(seed: int) -> None:
    rng = random.Random(seed)
    hands = Hands(rng)
    book, calls = book_with(hands, allow={"goto": ENVELOPE, "route": ENVELOPE}, waiting_max=100)

    async def play() -> None:
        for number, (name, arguments) in enumerate(hostile_calls(rng, 4000, [])):
            hands.is_flying = rng.random() < 0.5
            was_flying, before = hands.is_flying, len(hands.flown)
            await calls.call(name, arguments, 10.0 * number)
            if len(hands.flown) > before:
                assert was_flying

    asyncio.run(play())
    assert len(hands.flown) > 3
    for proposal in hands.flown:
        assert proposal.released_by == "the rules"
        assert proposal.act.kind in ("goto", "route")
        assert proposal.judgement is not None
        assert proposal.judgement.extent is not None
        assert not breaches(proposal.judgement.extent, ENVELOPE)
        assert not proposal.arms
    assert all(each.state is not ProposalState.REHEARSING for each in book.all(0.0))


@given(st.lists(st.floats(0.0, 100.0), min_size=7, max_size=7))
def test_each_limit_of_an_envelope_counts(limits: list[float]) -> None:
    extent = FlightExtent(50.0, 50.0, 50.0, 50.0, 50.0, 50.0, 50.0)
    radius, low, high, speed, duration, battery, clearance = limits
    envelope = ActEnvelope(radius, low, high, speed, duration, battery, clearance)
    upper = [each < 50.0 for each in (radius, high, speed, duration)]
    lower = [each > 50.0 for each in (low, battery, clearance)]
    assert len(breaches(extent, envelope)) == sum(upper) + sum(lower)


def test_hold_is_taken_whatever_its_arguments_are_and_however_many_calls_there_were() -> None:
    hands = Hands(random.Random(0))
    book = ProposalBook("agent", AgentRules("", calls_per_minute=2.0), "000000")
    calls = ToolCalls(book, hands)

    async def play() -> None:
        replies = [await calls.call("state", {}, 0.1 * i) for i in range(5)]
        assert [each.rejected for each in replies] == [False, False, True, True, True]
        rejected = replies[-1].value["rejected"]
        assert isinstance(rejected, dict)
        assert rejected["code"] == "RATE_LIMIT"
        assert rejected["accepted"]["calls_per_minute"] == 2.0
        for arguments in (None, {}, {"by": 1}, [1], "now"):
            assert not (await calls.call("hold", arguments, 1.0)).rejected
        assert not (await calls.call("state", {}, 61.0)).rejected

    asyncio.run(play())
    assert hands.holds == 5


def proposed(book: ProposalBook, now: float = 0.0) -> AgentProposal:
    proposal = book.propose(AgentGoto(1.0, 2.0, 3.0), now)
    assert not book.judge(proposal, Judgement("SUCCESS", "", None, (0.0, 0.0, 5.0), True))
    return proposal


@pytest.mark.parametrize(
    ("position", "flies", "now", "code"),
    [
        ((9.0, 0.0, 5.0), True, 1.0, "VEHICLE_MOVED"),
        (None, True, 1.0, "VEHICLE_MOVED"),
        ((0.0, 0.0, 5.0), False, 1.0, "VEHICLE_MOVED"),
        ((0.0, 0.0, 5.0), True, 1000.0, "NOT_WAITING"),
    ],
)
def test_an_old_confirmation_flies_nothing(
    position: Vector3 | None, flies: bool, now: float, code: str
) -> None:
    book, _ = book_with(Hands(random.Random(0)))
    proposal = proposed(book)
    with pytest.raises(ToolRejection) as caught:
        book.confirm(proposal.id, "a person", position, flies, now)
    assert caught.value.code == code
    with pytest.raises(ToolRejection, match="NOT_WAITING"):
        book.confirm(proposal.id, "a person", (0.0, 0.0, 5.0), True, now)


@pytest.mark.parametrize("act", [AgentReturn(), AgentLanding()])
def test_a_return_that_leaves_the_envelope_waits_for_a_person_who_sees_that(act: AgentAct) -> None:
    book, _ = book_with(Hands(random.Random(0)), envelope=ENVELOPE)
    proposal = book.propose(act, 0.0)
    extent = FlightExtent(9.0, 0.0, 15.0, 1.0, 9.0, 50.0, None)
    assert not book.judge(proposal, Judgement("SUCCESS", "", extent, (0.0, 0.0, 5.0), True))
    assert proposal.state is ProposalState.WAITING
    assert proposal.message == "The flight would leave the agent's envelope: height 15.0 m."
    assert proposal.value()["rehearsal"] == extent.value(), "the true heights are shown"


def test_a_proposal_is_confirmed_once() -> None:
    book, _ = book_with(Hands(random.Random(0)))
    proposal = proposed(book)
    assert book.confirm(proposal.id, "a person", (0.0, 0.0, 5.0), True, 1.0) is proposal
    for by in ("a person", "another"):
        with pytest.raises(ToolRejection, match="NOT_WAITING"):
            book.confirm(proposal.id, by, (0.0, 0.0, 5.0), True, 1.0)
    assert proposal.released_by == "a person"


@pytest.mark.parametrize(
    ("act", "extent", "state"),
    [
        (AgentGoto(1.0, 2.0, 3.0), None, ProposalState.REJECTED),
        (AgentTakeoff(5.0), None, ProposalState.REJECTED),
        # A take-off begins on the ground, whatever the lowest height is.
        (AgentTakeoff(5.0), FlightExtent(9, 0, 5, 1, 9, 50.0, None), ProposalState.WAITING),
        (AgentTakeoff(13.0), FlightExtent(9, 0, 13, 1, 9, 50.0, None), ProposalState.REJECTED),
        (AgentLanding(), FlightExtent(9, 0, 9, 1, 9, 50.0, None), ProposalState.WAITING),
        (AgentLanding(), None, ProposalState.WAITING),
        (AgentReturn(), None, ProposalState.WAITING),
        (AgentGoto(1.0, 2.0, 3.0), FlightExtent(9, 2, 9, 1, 9, 50.0, None), ProposalState.WAITING),
        (AgentGoto(1.0, 2.0, 3.0), FlightExtent(9, 2, 13, 1, 9, 50.0, 5), ProposalState.REJECTED),
    ],
)
def test_nothing_but_a_return_leaves_the_envelope_of_an_agent_not_even_with_a_person(
    act: AgentAct, extent: FlightExtent | None, state: ProposalState
) -> None:
    book, _ = book_with(Hands(random.Random(0)), envelope=ENVELOPE)
    proposal = book.propose(act, 0.0)
    start = (0.0, 0.0, 5.0)
    code = "" if extent is None else "SUCCESS"
    assert not book.judge(proposal, Judgement(code, "", extent, start, True))
    assert proposal.state is state
    if state is ProposalState.REJECTED:
        assert proposal.code == "OUTSIDE_ENVELOPE"
        with pytest.raises(ToolRejection, match="NOT_WAITING"):
            book.confirm(proposal.id, "a person", start, True, 1.0)
