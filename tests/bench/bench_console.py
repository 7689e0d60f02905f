"""Cost of the console: one vehicle on one page, and 20 vehicles on five pages.

The vehicles are simulated and fly; the pages are clients of the console's socket that read all
they are sent. The reference, in the same time, is a process with the same subscriptions that does
nothing with them. On a machine that others keep busy the pages get fewer updates, so the console's
processor time is that of an update times the rate that was asked for, and the rate has a goal for
one vehicle only. Memory is resident.
"""

from __future__ import annotations

import json
import os
import re
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import psutil
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect
from websockets.typing import Origin

from drone_navigation.processes import Process, free_domain, free_udp_port, ros_environment
from tests.bench.bench_fleet import set_up
from tests.bench.fleet_client import flying_limit_s
from tests.bench.limits import LATE_S, READY_S
from tests.bench.rows import NO_GOAL, row

HERE = Path(__file__).resolve().parent
ONE, MANY = (1, 1), (20, 5)
GOALS_CORES = {ONE: 0.15, MANY: 1.0}
GOAL_MB, GOAL_HZ = 400.0, 9.0
UPDATES_HZ = 10.0
WINDOW_S, SHORT_WINDOW_S = 10.0, 1.0
_ALIVE_S = 1.0


@dataclass(frozen=True)
class Cost:
    """Consumption of a process in the window: cores, and memory in MB."""

    cores: float
    memory_mb: float


class Page:
    """A page that is open: it says that it is alive, and counts the updates that it gets."""

    def __init__(self, address: str) -> None:
        """Open it."""
        socket = address.replace("http", "ws", 1).replace("/?", "/socket?")
        origin = Origin(address.partition("/?")[0])
        self._socket = connect(socket, origin=origin, max_size=None, compression=None)
        self.updates = 0
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self) -> None:
        alive_s = 0.0
        try:
            for _ in self._socket:
                self.updates += 1
                if time.monotonic() - alive_s > _ALIVE_S:
                    alive_s = time.monotonic()
                    self._socket.send('{"type": "alive"}')
        except ConnectionClosed:
            return


def measures(short: bool = False) -> Iterator[dict[str, Any]]:
    """Measure both."""
    for vehicles, pages in (ONE,) if short else (ONE, MANY):
        console, bare, updates_hz = measure(vehicles, pages, SHORT_WINDOW_S if short else WINDOW_S)
        what = f"console of {vehicles} vehicles on {pages} pages"
        if (vehicles, pages) == ONE:
            what = "console of one vehicle on one page"
        limit, other = GOALS_CORES[vehicles, pages], "the same subscriptions alone"
        yield from (
            row(
                f"{what}, processor",
                (console.cores, "cores"),
                (other, bare.cores),
                f"< {limit:g} cores",
            ),
            row(
                f"{what}, memory",
                (console.memory_mb, "MB"),
                (other, bare.memory_mb),
                f"< {GOAL_MB:g} MB",
            ),
            row(
                f"{what}, updates of a page",
                (updates_hz, "Hz"),
                ("what is asked for", UPDATES_HZ),
                f"> {GOAL_HZ:g} Hz" if vehicles == 1 else NO_GOAL,
            ),
        )


def measure(vehicles: int, pages: int, for_s: float) -> tuple[Cost, Cost, float]:
    """Fly a number of vehicles before a number of pages, and look at them for a time.

    Returns:
        Costs of the console and of the reference, and the least updates of a page, Hz.
    """
    port = free_udp_port()
    environment = ros_environment(free_domain(os.getpid() + vehicles))
    environment["PYTHONPATH"] = f"{HERE.parents[1]}:{environment.get('PYTHONPATH', '')}"
    with ExitStack() as on_exit:
        folder = Path(on_exit.enter_context(tempfile.TemporaryDirectory()))
        config = folder / "fleet.yaml"
        config.write_text(set_up(vehicles, port), encoding="utf-8")

        def start(title: str, *command: str) -> Process:
            process = Process(title, ["python", *command], environment)
            on_exit.callback(process.stop, 0.1)  # nobody waits for these vehicles to stop
            return process

        start("server", "-m", "drone_navigation.navigation_server", "--config", str(config))
        link = f"udpout://127.0.0.1:{port}"
        start("sitl", "-m", "mavlink_sitl", "--link", link, "--count", str(vehicles),
              "--ready-after", "1", "--quiet")  # fmt: skip
        console = start("console", "-m", "drone_navigation.navigation_console", "--no-browser")
        bare = start("bare", str(HERE / "bare_subscriber.py"), str(vehicles))
        bare.wait_for("ready", READY_S)
        found = re.search(r"http://\S+", console.wait_for("The console is at", READY_S))
        if found is None:
            raise RuntimeError("The console told no address.")
        opened = [Page(found[0]) for _ in range(pages)]
        client = start("client", str(HERE / "fleet_client.py"), str(vehicles), str(for_s))
        client.wait_for("flying", flying_limit_s(vehicles))
        for page in opened:
            page.updates = 0
        before, begun_s = [_used_s(each) for each in (console, bare)], time.monotonic()
        feedbacks_s = json.loads(client.wait_for("[", for_s + LATE_S))
        window_s = time.monotonic() - begun_s
        if not any(feedbacks_s):
            raise RuntimeError(f"None of {vehicles} vehicles flew.")
        costs = [
            Cost((_used_s(each) - used_s) / window_s, _memory_mb(each))
            for each, used_s in zip((console, bare), before, strict=True)
        ]
        updates_hz = min(page.updates for page in opened) / window_s
        if not updates_hz:
            raise RuntimeError("A page got no updates.")
        cores = costs[0].cores * max(UPDATES_HZ / updates_hz, 1.0)
        return Cost(cores, costs[0].memory_mb), costs[1], updates_hz


def _used_s(process: Process) -> float:
    times = psutil.Process(process.pid).cpu_times()
    return float(times.user + times.system)


def _memory_mb(process: Process) -> float:
    return float(psutil.Process(process.pid).memory_info().rss / 1e6)
