"""Rules of agents from a file, the extent of a rehearsed flight, and what a person decides."""

from __future__ import annotations

import asyncio
import hashlib
import random
import re
from pathlib import Path
from typing import Any

import pytest
import yaml

from drone_navigation.agents.acts import ACTS
from drone_navigation.agents.confirmations import FolderError, ask_all, confirming
from drone_navigation.agents.envelopes import extent_of
from drone_navigation.agents.proposals import ProposalState
from drone_navigation.agents.rules import RulesError, find_agent, read_rules
from drone_navigation.agents.tool_calls import tools
from tests.property.test_agents import Hands, book_with, proposed

PAGE = (Path(__file__).parents[3] / "docs/programs.md").read_text("utf-8")
TOKEN = "t" * 22
SHA = hashlib.sha256(TOKEN.encode()).hexdigest()


def test_the_file_that_the_page_shows_is_read_and_names_its_limits() -> None:
    (shown,) = re.findall(r"^```yaml\n(agents:.*?)^```", PAGE, re.MULTILINE | re.DOTALL)
    rules = read_rules(yaml.safe_load(shown))
    assert rules["planner"].allow["goto"].radius_m == 50
    assert set(rules["planner"].allow) == {"goto"}
    assert rules["planner"].envelope is None


@pytest.mark.parametrize(
    ("document", "reason"),
    [
        (None, "'agents'"),
        ({"agents": {}}, "by name"),
        ({"agents": {"A b": {}}}, "no name of an agent"),
        ({"agents": {"a": {}}}, "token_sha256 is missing"),
        ({"agents": {"a": {"token_sha256": "x"}}}, "64 hexadecimal digits"),
        ({"agents": {"a": {"token_sha256": SHA, "allow": {"takeoff": {}}}}}, "takeoff is unknown"),
        ({"agents": {"a": {"token_sha256": SHA, "allow": {"goto": {}}}}}, "radius_m is missing"),
        ({"agents": {"a": {"token_sha256": SHA, "arming": "auto"}}}, "arming is unknown"),
    ],
)
def test_a_file_that_cannot_be_used_has_a_sentence(document: object, reason: str) -> None:
    with pytest.raises(RulesError, match=re.escape(reason)):
        read_rules(document)


def test_an_agent_is_found_by_its_token_only() -> None:
    rules = read_rules({"agents": {"a": {"token_sha256": SHA}}})
    assert find_agent(rules, TOKEN) == "a"
    assert find_agent(rules, "") is find_agent(rules, SHA) is None
    # Not even where a file has the sum of nothing.
    empty = read_rules({"agents": {"a": {"token_sha256": hashlib.sha256(b"").hexdigest()}}})
    assert find_agent(empty, "") is None


def test_the_extent_is_that_of_the_path() -> None:
    flown: dict[str, Any] = {
        "path_enu_m": [(0.0, 0.0, 2.0), (1.0, 0.0, 2.0), (3.0, 4.0, 6.0), (3.0, 4.0, 6.0)],
        "times_s": [0.0, 1.0, 2.0, 9.0],
        "duration_s": 9.0,
        "battery": 0.5,
        "approach": {"clearance_m": 1.5},
    }
    extent = extent_of(flown)
    assert (extent.radius_m, extent.height_min_m, extent.height_max_m) == (5.0, 2.0, 6.0)
    assert extent.speed_max_m_s == pytest.approx(20**0.5)
    assert (extent.duration_s, extent.battery_percent, extent.clearance_m) == (9.0, 50.0, 1.5)
    without = extent_of({**flown, "battery": None, "approach": None})
    assert without.battery_percent is without.clearance_m is None


def test_each_tool_that_moves_has_bounds_on_every_number() -> None:
    def numbers(schema: Any) -> list[Any]:
        if schema.get("type") in ("number", "integer"):
            return [schema]
        inner = [
            *schema.get("properties", {}).values(),
            *([schema["items"]] if "items" in schema else []),
        ]
        return [found for each in inner for found in numbers(each)]

    for tool in tools():
        assert tool.schema["additionalProperties"] is False
        for schema in numbers(tool.schema):
            assert {"minimum", "maximum"} <= set(schema), (tool.name, schema)
    assert {tool.name for tool in tools() if tool.moves} == {*ACTS, "hold"}


def test_the_page_names_each_tool() -> None:
    table = PAGE.split("| Tool | |")[1].split("\n\n")[0]
    cells = "".join(row.split("|")[1] for row in table.splitlines() if row.startswith("| `"))
    assert set(re.findall(r"`(\w+)`", cells)) == {tool.name for tool in tools()}


def test_a_person_sees_confirms_and_rejects_through_the_socket(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    hands = Hands(random.Random(0))
    book, calls = book_with(hands)

    async def play() -> None:
        now = asyncio.get_running_loop().time()
        first, second = proposed(book, now), proposed(book, now)

        async def ask(**request: str) -> list[dict[str, Any]]:
            return await asyncio.to_thread(ask_all, request)

        async with confirming(calls):
            (listed,) = await ask(verb="list")
            assert [each["id"] for each in listed["proposals"]] == [first.id, second.id]
            (left,) = await ask(verb="confirm", id=first.id, by="ann")
            assert [each["id"] for each in left["proposals"]] == [second.id]
            (again,) = await ask(verb="confirm", id=first.id, by="ann")
            assert again["code"] == "NOT_WAITING"
            await ask(verb="reject", id=second.id, by="ann")
            await ask(verb="fly", id=second.id, by="ann")
        assert await ask(verb="list") == []
        assert hands.flown == [first]
        assert first.released_by == "ann"
        assert second.state is ProposalState.REJECTED

    asyncio.run(play())


def test_a_folder_that_others_may_write_is_not_used(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    assert ask_all({"verb": "list"}) == []
    (folder,) = tmp_path.iterdir()
    folder.chmod(0o777)
    with pytest.raises(FolderError, match="not this user's alone"):
        ask_all({"verb": "list"})
