"""Time from an agent's proposal to its rehearsed answer.

The official client of the Model Context Protocol calls `goto` through standard input and output;
the answer comes when the flight of half a minute was checked and rehearsed. The median of the calls
after the first one, for which the process of the rehearsals is started.
"""

from __future__ import annotations

import asyncio
import hashlib
import os
import statistics
import tempfile
import time
from pathlib import Path
from typing import Any

import yaml
from mcp import Client, StdioServerParameters

from tests.bench.rows import row
from tests.support.ros.ros_flight import Flight

GOAL_S = 1.0
CALLS, SHORT_CALLS = 9, 1
_TOKEN = "a-token-of-22-characters"
_LIMIT_S = 300.0


def measures(short: bool = False) -> list[dict[str, Any]]:
    """Propose flights to a server with a simulated vehicle."""
    with tempfile.TemporaryDirectory() as folder:
        flight = Flight(Path(folder))
        try:
            work = _propose(flight, folder, SHORT_CALLS if short else CALLS)
            first_s, median_s = asyncio.run(asyncio.wait_for(work, _LIMIT_S))
        finally:
            flight.close()
    limit = ("limit", GOAL_S)
    return [
        row("A proposal to its rehearsal", (median_s, "s"), limit, f"< {GOAL_S:g} s"),
        row("The same, the first one of an agent", (first_s, "s"), limit, "-"),
    ]


async def _propose(flight: Flight, folder: str, calls: int) -> tuple[float, float]:
    sha = hashlib.sha256(_TOKEN.encode()).hexdigest()
    # No proposal is confirmed, and each one waits.
    agent = {"token_sha256": sha, "calls_per_minute": 6000, "waiting_max": calls + 1}
    rules = Path(folder) / "rules.yaml"
    rules.write_text(yaml.safe_dump({"agents": {"planner": agent}}), "utf-8")
    serve = ["-m", "drone_navigation.agents.navigation_mcp", "serve", "--rules", str(rules)]
    own = {"XDG_RUNTIME_DIR": folder, "NAVIGATION_MCP_TOKEN": _TOKEN}
    command = StdioServerParameters(
        command="python",
        args=[*serve, "--server-timeout", "60"],
        env={**os.environ, **flight.environment, **own},
    )
    times_s = []
    async with Client(command, read_timeout_seconds=_LIMIT_S) as client:
        for number in range(calls + 1):
            begun_s = time.monotonic()
            result = await client.call_tool("goto", {"x_m": 40.0, "y_m": number, "z_m": 5.0})
            times_s.append(time.monotonic() - begun_s)
            value = result.structured_content or {}
            if "rehearsal" not in value:
                raise RuntimeError(f"The proposal was not rehearsed: {value}")
    return times_s[0], statistics.median(times_s[1:])
