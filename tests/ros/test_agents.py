"""An agent by the official client of its protocol, a person at a terminal, and the vehicle."""

from __future__ import annotations

import asyncio
import base64
import getpass
import hashlib
import os
import random
import signal
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any, TypeAlias

import pytest
import yaml
from mcp import Client, StdioServerParameters
from mcp.types import ImageContent
from PIL import Image

from tests.support.agents import hostile_calls
from tests.support.processes import Process
from tests.support.ros.ros_flight import FLIGHT_TIMEOUT_S, Flight, navigate_goal
from tests.support.ros.terminal import Terminal

pytestmark = pytest.mark.xdist_group("ros_agents")
LIMIT_S = 300.0
TOKEN = "a-token-of-22-characters"
WIDE = {
    "radius_m": 60, "height_min_m": 1, "height_max_m": 20, "speed_max_m_s": 6,
    "duration_max_s": 300, "battery_min_percent": 0, "clearance_min_m": 0,
}  # fmt: skip
Play: TypeAlias = Callable[[Client], Awaitable[None]]


class Stage:
    """Runs agents beside a flight."""

    def __init__(self, flight: Flight, folder: Path, runtime: Path) -> None:
        self.flight = flight
        self.environment = {**flight.environment, "XDG_RUNTIME_DIR": str(runtime)}
        self.rules = folder / "rules.yaml"

    def allow(self, **rules: object) -> None:
        """Write the rules of an agent named planner."""
        sha = hashlib.sha256(TOKEN.encode()).hexdigest()
        agent = {"token_sha256": sha, "calls_per_minute": 6000, **rules}
        self.rules.write_text(yaml.safe_dump({"agents": {"planner": agent}}), "utf-8")

    def in_the_air(self) -> None:
        """Have the copter hold at 4 m, wherever a test before has left it."""
        if not self.flight.is_armed:
            self.flight.wait_for_result(self.flight.send(navigate_goal(0.0, 0.0, 4.0)))

    def play(self, play: Play, *options: str) -> None:
        """Let an agent act until its end of the pipe is closed."""

        async def within_limits() -> None:
            async with self.agent(*options) as client:
                await play(client)

        asyncio.run(asyncio.wait_for(within_limits(), LIMIT_S))

    @asynccontextmanager
    async def agent(self, *options: str) -> AsyncIterator[Client]:
        """Start the command as an agent's host does."""
        environment = {**self.environment, "NAVIGATION_MCP_TOKEN": TOKEN}
        command = StdioServerParameters(
            command="python",
            args=[
                "-m", "drone_navigation.agents.navigation_mcp", "serve", "--rules",
                str(self.rules), "--server-timeout", "60", *options,
            ],
            env=environment,
        )  # fmt: skip
        async with Client(command, read_timeout_seconds=LIMIT_S) as client:
            yield client

    async def decide(self, verb: str, proposal: str, typed: str = "") -> str:
        """Decide as a person at a terminal."""
        words = ["-m", "drone_navigation.agents.navigation_mcp", verb, proposal]

        def at_terminal() -> str:
            terminal = Terminal(words, self.environment)
            try:
                if typed:
                    terminal.wait_for("Type yes", FLIGHT_TIMEOUT_S)
                    terminal.type(f"{typed}\n")
                terminal.wait(FLIGHT_TIMEOUT_S)
                return terminal.text
            finally:
                terminal.close()

        return await asyncio.to_thread(at_terminal)


@pytest.fixture
def stage(flight: Flight, tmp_path: Path, tmp_path_factory: pytest.TempPathFactory) -> Stage:
    made = Stage(flight, tmp_path, tmp_path_factory.mktemp("r"))
    made.allow()
    return made


async def call(client: Client, tool: str, **arguments: object) -> dict[str, Any]:
    result = await client.call_tool(tool, arguments)
    value = result.structured_content
    assert isinstance(value, dict)
    assert result.is_error is ("rejected" in value)
    return value


async def until(client: Client, proposal: str, state: str) -> dict[str, Any]:
    while True:
        value = await call(client, "proposal", id=proposal, wait_s=5)
        if value["state"] == state:
            return value


def test_an_agent_proposes_a_person_confirms_and_the_vehicle_flies(stage: Stage) -> None:
    stage.allow(waiting_max=5)
    stage.flight.ground()

    async def play(client: Client) -> None:
        named = {each.name: each.input_schema for each in (await client.list_tools()).tools}
        assert named["goto"]["properties"]["z_m"]["maximum"] == 500
        assert (await call(client, "state"))["state"]["armed"] is False

        for tool in ("land", "return"):
            assert (await call(client, tool))["rejected"]["code"] == "NOT_FLYING"
        up = await call(client, "takeoff", height_m=4)
        assert up["arms_and_takes_off"]
        assert up["rehearsal"]["height_max_m"] == pytest.approx(4, abs=1)
        assert up["state"] == "waiting for a person"
        assert not stage.flight.is_armed
        assert "ARMS the vehicle" in await stage.decide("confirm", up["id"], "no")
        assert (await call(client, "proposal", id=up["id"]))["state"] == "waiting for a person"
        assert not stage.flight.is_armed
        assert "Done." in await stage.decide("confirm", up["id"], "yes")
        assert (await until(client, up["id"], "ended"))["code"] == "SUCCESS"

        again = await call(client, "takeoff", height_m=4)
        assert again["rejected"]["code"] == "ALREADY_FLYING"
        there = await call(client, "goto", x_m=6, y_m=0, z_m=4)
        assert not there["arms_and_takes_off"]
        flown = there["rehearsal"]
        assert flown["radius_m"] == pytest.approx(6, abs=1.5)
        assert 0 < flown["speed_max_m_s"] < 10
        drawn = await client.call_tool("picture", {"id": there["id"]})
        (image,) = [each for each in drawn.content if isinstance(each, ImageContent)]
        picture = Path((drawn.structured_content or {})["picture"])
        assert base64.b64decode(image.data) == picture.read_bytes()
        with Image.open(picture) as opened:
            assert (opened.format, opened.size) == ("PNG", (900, 800))
        assert (
            len((await client.call_tool("picture", {"id": there["id"], "image": False})).content)
            == 1
        )
        assert (await call(client, "picture", id="x"))["rejected"]["code"] == "UNKNOWN_PROPOSAL"
        shown = await stage.decide("confirm", there["id"], "yes")
        assert f"picture: {picture}" in shown
        assert "m of the map origin" in shown
        ended = await until(client, there["id"], "ended")
        assert (ended["code"], ended["released_by"]) == ("SUCCESS", getpass.getuser())
        by = f"Sent by agent planner, released by {getpass.getuser()} as {there['id']}."
        assert stage.flight.server is not None
        assert by in stage.flight.server.text
        events = (await call(client, "events"))["events"]
        assert by in [each["text"] for each in events]
        assert (await call(client, "state"))["state"]["position_enu_m"][0] > 4

        # Nothing but the bounds comes back for what no act can be.
        for arguments in ({"x_m": 1}, {"x_m": 1, "y_m": 2, "z_m": 1e9}, {"x_m": "1"}):
            rejected = (await call(client, "goto", **arguments))["rejected"]
            assert rejected["code"] == "INVALID_ARGUMENTS"
            assert rejected["accepted"]["properties"]["z_m"]["maximum"] == 500
        far = await call(client, "goto", x_m=9000, y_m=0, z_m=4)
        assert far["rejected"]["code"] == "OUTSIDE_VOLUME"
        (volume,) = far["rejected"]["accepted"]["vehicle"]["flight_volume"]["areas"]
        assert 10 < volume["radius"] < 9000

        down = (await call(client, "land"))["rehearsal"]
        assert down["height_min_m"] == pytest.approx(0, abs=0.5)
        assert down["radius_m"] == pytest.approx(6, abs=1.5)
        back = (await call(client, "return"))["rehearsal"]
        assert back["height_max_m"] > 10, "the autopilot climbs first"
        assert back["duration_s"] > down["duration_s"]

        dull = await call(client, "goto", x_m=0, y_m=0, z_m=4)
        assert "Done." in await stage.decide("reject", dull["id"])
        assert (await call(client, "proposal", id=dull["id"]))["state"] == "rejected"

        (flight,) = (await call(client, "report"))["report"]["flights"]
        goal = flight["goals"][-1]
        assert (goal["code"], goal["targets_enu_m"]) == ("SUCCESS", [[6.0, 0.0, 4.0]])
        assert flight["highest_m"] == pytest.approx(4, abs=1)
        assert flight["distance_m"] > 8

    stage.play(play, "--tlog", str(stage.flight.folder))


def test_the_rules_let_an_agent_fly_within_its_envelope_and_hold_and_no_further(
    stage: Stage,
) -> None:
    stage.allow(allow={"goto": WIDE})
    stage.in_the_air()

    async def play(client: Client) -> None:
        near = await call(client, "goto", x_m=50, y_m=0, z_m=4, speed_m_s=1)
        assert (near["state"], near["released_by"]) == ("flying", "the rules")
        await asyncio.sleep(3.0)
        assert "message" in await call(client, "hold")
        assert (await until(client, near["id"], "ended"))["code"] == "PREEMPTED"
        far = await call(client, "goto", x_m=90, y_m=0, z_m=4)
        assert far["state"] == "waiting for a person"
        assert "radius" in far["message"]
        ring = await call(client, "orbit", x_m=0, y_m=0, height_m=4, radius_m=5)
        assert ring["state"] == "waiting for a person"

    stage.play(play)


def test_an_agent_that_is_cut_off_leaves_a_holding_vehicle(stage: Stage) -> None:
    stage.allow(allow={"goto": WIDE})
    stage.in_the_air()
    assert stage.flight.server is not None
    line = len(stage.flight.server.lines)

    async def play(client: Client) -> None:
        away = await call(client, "goto", x_m=-50, y_m=0, z_m=4, speed_m_s=1)
        assert away["state"] == "flying"
        await asyncio.sleep(2.0)

    stage.play(play)
    stage.flight.server.wait_for("ended: CANCELED", FLIGHT_TIMEOUT_S, after=line)
    assert stage.flight.is_armed


def process_of(stage: Stage) -> int:
    """Return the id of the process that serves the agent, by the socket that it has opened."""
    (path,) = Path(stage.environment["XDG_RUNTIME_DIR"]).glob("navigation_mcp-*/*.sock")
    return int(path.stem)


@pytest.mark.parametrize("sent", [signal.SIGKILL, signal.SIGSTOP])
def test_the_vehicle_holds_once_the_process_of_an_agent_is_not_heard_any_more(
    stage: Stage, sent: signal.Signals
) -> None:
    stage.allow(allow={"goto": WIDE})
    stage.in_the_air()
    server = stage.flight.server
    assert server is not None
    line = len(server.lines)

    async def play(client: Client) -> None:
        away = await call(client, "goto", x_m=0, y_m=-50, z_m=4, speed_m_s=0.5)
        assert away["state"] == "flying"
        await asyncio.sleep(8.0)  # longer than a lease: it is renewed
        assert not [each for each in server.lines[line:] if "ended" in each]
        os.kill(process_of(stage), sent)
        ended = await asyncio.to_thread(server.wait_for, "ended: ", FLIGHT_TIMEOUT_S, after=line)
        assert "ended: CLIENT_LOST" in ended
        if sent is signal.SIGSTOP:
            os.kill(process_of(stage), signal.SIGCONT)
            assert (await until(client, away["id"], "ended"))["code"] == "CLIENT_LOST"

    stage.play(play)
    assert stage.flight.is_armed
    assert stage.flight.call("hold").success


def test_hostile_calls_over_the_wire_move_nothing(stage: Stage) -> None:
    assert stage.flight.server is not None
    line = len(stage.flight.server.lines)

    async def play(client: Client) -> None:
        rng = random.Random(1)
        ids: list[str] = []
        for name, arguments in hostile_calls(rng, 150, ids):
            given = arguments if isinstance(arguments, dict) else {"argument": arguments}
            if _is_json(given):
                reply = await client.call_tool(name, given)
                if not reply.is_error and isinstance(reply.structured_content, dict):
                    ids.append(str(reply.structured_content.get("id", "")))
        assert (await call(client, "state"))["state"]["connected"]
        assert (await call(client, "report"))["rejected"]["code"] == "NO_RECORDING"

    stage.play(play)
    heard = stage.flight.server.lines[line:]
    assert not [each for each in heard if "accepted" in each], heard


def _is_json(value: dict[str, object]) -> bool:
    """Whether the client of the protocol can send it; the unit tests have the rest."""
    text = repr(value)
    return "\\x00" not in text and "0" * 300 not in text


def test_a_wrong_token_is_no_agent(stage: Stage) -> None:
    environment = {**stage.environment, "NAVIGATION_MCP_TOKEN": "another-token-altogether"}
    words = ["python", "-m", "drone_navigation.agents.navigation_mcp", "serve"]
    process = Process("mcp", [*words, "--rules", str(stage.rules)], environment)
    assert process.wait(FLIGHT_TIMEOUT_S) == 2, process.text
    assert "has the token in NAVIGATION_MCP_TOKEN" in process.text
