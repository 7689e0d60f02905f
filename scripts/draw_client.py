"""Draw docs/client.svg: ``python scripts/draw_client.py``, the client in a simulated flight."""

from __future__ import annotations

import io
import json
import math
import os
import shlex
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any, get_args

from draw_check import save_svg
from rich.console import Console

from drone_navigation.client import events as client_events
from drone_navigation.client.terminal.live import LiveView
from drone_navigation.processes import Process, free_domain, free_udp_port, ros_environment

ROOT = Path(__file__).resolve().parents[1]
WORLD = ROOT / "bridge_config/worlds/demo.yaml"
PICTURE = ROOT / "docs/client.svg"
COMMAND = 'navigation_client --goal 20 0 4 --avoid --update "t=8: 0 18 4"'
_WIDTH = 88
_LIMIT_S = 90.0
_KINDS = {kind.name: kind for kind in get_args(client_events.Event)}


def main() -> None:
    """Fly in a simulated world, and draw what the client showed at one moment."""
    view_console = Console(width=_WIDTH, force_terminal=True, file=io.StringIO())
    picture = Console(width=_WIDTH, force_terminal=True, record=True, file=io.StringIO())
    view = LiveView(view_console, keys=True)
    flown = list(_flown())
    if any(members["event"] == client_events.Rejected.name for members in flown):
        sys.exit("A goal was rejected: draw it again when the machine is less busy.")
    moment_s = _moment_s(flown)
    for members in flown:
        t_s = members.pop("t_s")
        if t_s > moment_s:
            break
        name = members.pop("event")
        if name == client_events.Telemetry.name:
            view.show(client_events.Telemetry(**members), t_s)
        else:
            event = _KINDS[name](**members)
            view.tell(event, t_s)
            picture.print(view.line(event))
    picture.print(view.block(moment_s))
    view.close()
    save_svg(picture, COMMAND, PICTURE)


def _moment_s(flown: list[dict[str, Any]]) -> float:
    """Return a moment in which a path is flown, nothing was blocked yet and most has happened.

    Best it is the last goal's, after a replan.
    """
    blocked_s = [members["t_s"] for members in flown if members.get("status") == "BLOCKED"]
    end_s = min(blocked_s, default=math.inf)
    flying = [one for one in flown if one.get("status") == "NAVIGATING" and one["t_s"] < end_s]
    last = [members for members in flying if members["goal"] == flying[-1]["goal"]]
    replanned = [members for members in last if members["replans"]] or last
    return float(replanned[3 * len(replanned) // 4]["t_s"])


def _flown() -> Iterator[dict[str, Any]]:
    environment = ros_environment(free_domain(os.getpid()))
    port = free_udp_port()
    server, simulator = (
        ["python", "-m", "drone_navigation.navigation_server", "--arming", "auto"],
        ["python", "-m", "mavlink_sitl", "--world", str(WORLD), "--ready-after", "1"],
    )
    processes = [
        Process("server", [*server, "--link", f"udpin://127.0.0.1:{port}"], environment),
        Process("simulator", [*simulator, "--link", f"udpout://127.0.0.1:{port}"], environment),
    ]
    try:
        processes[0].wait_for("Position valid", _LIMIT_S)
        module = ["python", "-m", "drone_navigation.navigation_client", "--json"]
        client = Process("client", [*module, *shlex.split(COMMAND)[1:]], environment)
        processes.append(client)
        client.wait(_LIMIT_S)
        yield from map(json.loads, client.lines)
    finally:
        for process in reversed(processes):
            process.stop()


if __name__ == "__main__":
    main()
