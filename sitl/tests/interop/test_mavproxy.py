"""MAVProxy, unmodified from PyPI and headless, flies the simulator over UDP.

In real time: when it is late, its socket overflows, and it does not repeat a command whose
acknowledgement or a request whose answer was lost. At eight times real time and with six of these
tests at once, eleven of twelve failed so.
"""

from __future__ import annotations

import contextlib
import subprocess
import sys
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from pymavlink.dialects.v20 import all as mav

from pytest_mavlink_sitl import simulator_process
from sitl_support.programs import environment
from sitl_support.tlogs import read_records

pytestmark = pytest.mark.wide

WAIT_S = 120.0
MISSION = """QGC WPL 110
0 1 0 16 0 0 0 0 -35.3632610 149.1652300 584.0 1
1 0 3 22 0 0 0 0 0 0 10.0 1
2 0 3 16 0 0 0 0 -35.3630813 149.1652300 10.0 1
3 0 3 16 0 0 0 0 -35.3630813 149.1654503 12.0 1
""".replace(" ", "\t").replace("QGC\tWPL\t", "QGC WPL ")
MODULES = "mode,arm,wp,cmdlong,param,link,misc,log,ftp"


class MavProxy:
    """The program's console.

    Attributes:
        lines: what it has printed.
    """

    def __init__(self, process: subprocess.Popen[str]) -> None:
        self.lines: list[str] = []
        self._process = process
        self._seen = 0
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            self.lines.append(line.rstrip())

    def close(self) -> None:
        """Let go of the program's pipes, once it has ended."""
        self._reader.join(WAIT_S)
        for pipe in (self._process.stdin, self._process.stdout):
            if pipe is not None:
                pipe.close()

    def say(self, command: str) -> None:
        assert self._process.stdin is not None
        self._process.stdin.write(command + "\n")
        self._process.stdin.flush()

    def hear(self, words: str) -> None:
        """Wait for words in a line after those heard before."""
        limit_s = time.monotonic() + WAIT_S
        while time.monotonic() < limit_s:
            while self._seen < len(self.lines):
                self._seen += 1
                if words in self.lines[self._seen - 1]:
                    return
            time.sleep(0.02)
        printed = "\n".join(self.lines[-30:])
        pytest.fail(f"MAVProxy never says {words!r}; it said:\n{printed}")


@contextlib.contextmanager
def mavproxy(port: int, directory: Path) -> Iterator[MavProxy]:
    """MAVProxy on a port; whatever happens, it does not outlive the test."""
    program = [sys.executable, "-m", "MAVProxy.mavproxy", "--master", f"udp:127.0.0.1:{port}"]
    options = ["--default-modules", MODULES, "--state-basedir", str(directory)]
    process = subprocess.Popen(
        [*program, *options],
        env=environment(HOME=str(directory), MAVLINK20="1", PYTHONWARNINGS="ignore"),
        cwd=directory,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    console = MavProxy(process)
    try:
        yield console
    finally:
        process.kill()
        process.wait()
        console.close()


def test_mode_arm_takeoff_mission_guided_and_rtl(tmp_path: Path) -> None:
    mission = tmp_path / "mission.txt"
    mission.write_text(MISSION)
    with simulator_process() as port, mavproxy(port, tmp_path) as console:
        # It starts slowly on a busy machine, and misses what the vehicle said before.
        console.hear("Received ")
        console.say("mode guided")
        console.hear("Mode GUIDED")
        console.say("arm throttle")
        console.hear("ARMED")
        console.say("takeoff 10")
        console.hear("NAV_TAKEOFF: ACCEPTED")
        console.hear("height ")
        console.say(f"wp load {mission}")
        console.hear("TYPE_MISSION: ACCEPTED")
        console.hear("Flight plan received")
        console.say("wp list")
        console.hear("22 3 0.0000000000 0.0000000000 10.000000")
        console.hear("Saved 4 waypoints")
        console.say("mode auto")
        console.hear("Mode AUTO")
        console.hear("Reached command #2")
        console.say("mode guided")
        console.hear("Mode GUIDED")
        console.say("guided -35.3630813 149.16523 15")
        console.hear("DO_REPOSITION: ACCEPTED")
        console.say("rtl")
        console.hear("Mode RTL")
        console.hear("DISARMED")


def sent_types(log: Path) -> Counter[str]:
    """How often MAVProxy has sent each message, by its own recording."""
    parser = mav.MAVLink(None)
    frames = [frame for _, frame in read_records(log.read_bytes())]
    messages = [parser.decode(bytearray(frame)) for frame in frames]
    return Counter(m.get_type() for m in messages if m.get_srcSystem() == 255)


def test_parameters_come_at_once_and_logs_and_files_are_listed(tmp_path: Path) -> None:
    with simulator_process() as port, mavproxy(port, tmp_path) as console:
        console.hear("Saved ")
        console.say("log list")
        console.hear("No logs")
        console.say("ftp list")
        console.hear("D APM")
        console.hear("Total size")
        console.say("mode guided")
        console.hear("Mode GUIDED")
        console.say("arm throttle")
        console.hear("ARMED")
        console.say("disarm")
        console.hear("DISARMED")
        console.say("log list")
        console.hear("Log 1  numLogs 1 lastLog 1")
        console.say("ftp list /APM/LOGS")
        console.hear("00000001.BIN")
        console.say(f"log download 1 {tmp_path / 'flight.bin'}")
        console.hear("Finished downloading")
    # Asked for once: nothing was missing that would have been asked for again, seconds later.
    sent = sent_types(tmp_path / "mav.tlog")
    assert sent["PARAM_REQUEST_LIST"] <= 1
    assert sent["PARAM_REQUEST_READ"] == 0
    assert (tmp_path / "flight.bin").read_bytes()[:2] == b"\xa3\x95"


def test_files_are_put_got_and_removed_and_parameters_come_as_one(tmp_path: Path) -> None:
    sent, received, parameters = (tmp_path / name for name in ("sent", "received", "parameters"))
    sent.write_bytes(bytes(range(256)) * 20)
    with simulator_process() as port, mavproxy(port, tmp_path) as console:
        console.hear("Saved ")
        console.say(f"ftp put {sent} /new.bin")
        console.hear("Putting ")
        wait_for(console, "ftp list /", "new.bin")
        console.say(f"ftp get /new.bin {received}")
        console.hear("Getting ")
        until(lambda: received.exists() and received.read_bytes() == sent.read_bytes())
        console.say("ftp rm /new.bin")
        console.say(f"ftp get @PARAM/param.pck {parameters}")
        until(lambda: parameters.exists() and parameters.read_bytes()[:2] == b"\x1b\x67")


def wait_for(console: MavProxy, command: str, words: str) -> None:
    """Say a command again and again until it prints some words."""

    def printed() -> bool:
        console.say(command)
        time.sleep(1.0)
        return any(words in line for line in console.lines[-6:])

    until(printed)


def until(condition: Callable[[], bool]) -> None:
    limit_s = time.monotonic() + WAIT_S
    while not condition():
        assert time.monotonic() < limit_s
        time.sleep(0.05)
