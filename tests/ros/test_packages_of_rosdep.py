"""Server, client and console with no packages but those that rosdep installs on Ubuntu 24.04."""

from __future__ import annotations

import json
import subprocess
import sys
import time
import urllib.request
from collections.abc import Iterator

import pytest
from websockets.sync.client import connect
from websockets.typing import Origin

from tests.ros.test_console import address_of
from tests.support.hidden_packages import hide, modules_beside
from tests.support.processes import HANGS_AFTER_S, Process, patient_s
from tests.support.ros.ros_flight import READY_TIMEOUT_S, Flight
from tests.support.rosdep import DISTRIBUTION_OF, PYPI_ONLY

pytestmark = [pytest.mark.wide, pytest.mark.xdist_group("ros_rosdep")]
CLIENT = ["python", "-m", "drone_navigation.navigation_client"]
CONSOLE = ["python", "-m", "drone_navigation.navigation_console", "--no-browser"]
# pymavlink, which has a key, needs fastcrc.
MISSING = PYPI_ONLY.keys() - {"fastcrc"}
# Ubuntu's websockets is 10.4, whose server newer ones call "legacy".
SINCE_WEBSOCKETS_13 = "websockets.asyncio.server"


@pytest.fixture(scope="module")
def bare(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Flight]:
    """A flight whose processes find nothing else."""
    hidden = modules_beside(DISTRIBUTION_OF.values())
    entry = hide({*hidden, *MISSING, SINCE_WEBSOCKETS_13}, tmp_path_factory.mktemp("hidden"))
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PYTHONPATH", entry, prepend=":")
        flight = Flight(tmp_path_factory.mktemp("flight"))
    yield flight
    flight.close()


def test_what_has_no_key_is_missing(bare: Flight) -> None:
    for name in MISSING:
        done = subprocess.run(
            [sys.executable, "-c", f"import {name}"],
            env=bare.environment,
            capture_output=True,
            text=True,
            timeout=HANGS_AFTER_S,
            check=False,
        )
        assert "ModuleNotFoundError" in done.stderr, name


def test_the_server_flies_what_the_client_asks_for(bare: Flight) -> None:
    goal = ("--goal", "6", "0", "3", "--json")
    client = Process("client", [*CLIENT, *goal], bare.environment)
    assert client.wait(90.0) == 0, client.text
    events = [json.loads(line) for line in client.text.splitlines()]
    assert [event["code"] for event in events if event["event"] == "ended"] == ["SUCCESS"]
    assert bare.server is not None
    assert "without Ruckig" in bare.server.text


def test_the_console_shows_the_vehicle(bare: Flight) -> None:
    console = Process("navigation_console", CONSOLE, bare.environment)
    try:
        address = address_of(console)
        page = urllib.request.urlopen(address, timeout=READY_TIMEOUT_S)
        assert (page.status, b"<script" in page.read()) == (200, True)
        origin, _, query = address.partition("/?")
        socket = f"{origin.replace('http', 'ws', 1)}/socket?{query}"
        with connect(socket, origin=Origin(origin), max_queue=None) as opened:
            deadline_s = time.monotonic() + patient_s(READY_TIMEOUT_S)
            seen = ""
            while '"position_valid": true' not in seen:
                assert time.monotonic() < deadline_s, seen
                seen += str(opened.recv(timeout=READY_TIMEOUT_S))
        assert console.stop() == 0
    finally:
        console.stop()
