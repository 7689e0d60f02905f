"""Start, monitor and stop the processes of a flight; find free ports and ROS domains."""

from __future__ import annotations

import contextlib
import os
import random
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

_LOOPBACK = "127.0.0.1"
_DOMAIN_MAX = 101
# Where the first participant of a domain receives discovery traffic (DDSI-RTPS 2.3,
# 9.6.1.1: port base 7400, domain gain 250, offset d1 10).
_PORT_BASE, _DOMAIN_GAIN, _OFFSET = 7400, 250, 10
_PORT_MIN, _PORT_MAX, _PORTS_TRIED = 61000, 65500, 100
_READY_TIMEOUT_S = 20.0
_END_TIMEOUT_S = 10.0


class ProcessError(RuntimeError):
    """A process failed; the text ends with its last output."""


def free_udp_port() -> int:
    """Return a free UDP port of the loopback interface, which no other program is given by chance.

    Ports that a system gives out by itself (Linux: 32768 to 60999) are taken again in the next
    moment, by the sockets of DDS first of all.

    Raises:
        ProcessError: none was found.
    """
    for port in random.sample(range(_PORT_MIN, _PORT_MAX + 1), _PORTS_TRIED):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            try:
                probe.bind((_LOOPBACK, port))
            except OSError:
                continue
            return port
    raise ProcessError("No free UDP port was found; stop other programs.")


def free_domain(start: int) -> int:
    """Return a ROS domain that nobody on this machine uses, trying from ``start`` on.

    Raises:
        ProcessError: all domains are taken.
    """
    for offset in range(_DOMAIN_MAX):
        domain = 1 + (start + offset) % _DOMAIN_MAX
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            try:
                probe.bind(("", _PORT_BASE + _DOMAIN_GAIN * domain + _OFFSET))
            except OSError:
                continue
            return domain
    raise ProcessError("No ROS domain from 1 to 101 is free; stop other ROS programs.")


def ros_environment(domain: int) -> dict[str, str]:
    """Return this process's environment, kept to this machine and to one ROS domain."""
    environment = dict(os.environ)
    environment["ROS_DOMAIN_ID"] = str(domain)
    environment["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
    environment.pop("ROS_STATIC_PEERS", None)
    environment["PYTHONUNBUFFERED"] = "1"
    return environment


def run_in_terminal(
    arguments: Sequence[str],
    environment: Mapping[str, str],
    timeout_s: float | None = None,
    *,
    ends_itself: bool = False,
) -> int:
    """Run ``python -m MODULE ...`` with this terminal as its own, and return its exit code.

    Args:
        arguments: the module and its arguments.
        environment: of the child.
        timeout_s: None to wait for as long as it runs.
        ends_itself: pass an interrupt on and wait for the end; otherwise it is killed then.

    Raises:
        ProcessError: it is still running after ``timeout_s``.
    """
    child = subprocess.Popen([sys.executable, "-m", *arguments], env=dict(environment))
    try:
        return child.wait(timeout_s)
    except subprocess.TimeoutExpired:
        raise ProcessError(f"{arguments[0]} did not end within {timeout_s:g} s") from None
    except KeyboardInterrupt:
        if not ends_itself:
            raise
        child.send_signal(signal.SIGINT)
        return child.wait(_END_TIMEOUT_S)
    finally:
        if child.poll() is None:
            child.kill()
            child.wait()


@contextlib.contextmanager
def simulated_vehicle(
    server: Sequence[str], simulator: Sequence[str], logs: Path | None = None
) -> Iterator[dict[str, str]]:
    """Run a navigation server and its simulator, on a link and in a ROS domain of their own.

    Args:
        server: arguments of the server, but for the link.
        simulator: those of the simulator.
        logs: folder for what they print, or None.

    Yields:
        The environment of the server's clients, once it is ready for goals.

    Raises:
        ProcessError: one of them failed.
    """
    environment = ros_environment(free_domain(os.getpid()))
    link = f"//127.0.0.1:{free_udp_port()}"
    commands = {
        "navigation_server": [
            "drone_navigation.navigation_server", "--link", f"udpin:{link}", *server,
        ],
        "mavlink_sitl": ["mavlink_sitl", "--link", f"udpout:{link}", *simulator],
    }  # fmt: skip
    processes: list[Process] = []
    try:
        for name, words in commands.items():
            log = None if logs is None else logs / f"{name}.log"
            processes.append(Process(name, ["python", "-m", *words], environment, log))
        processes[0].wait_for("Position valid", _READY_TIMEOUT_S)
        yield environment
    finally:
        for process in reversed(processes):
            process.stop()


def _descendants(pid: int) -> list[int]:
    """Return the processes that a process has started, and theirs; none where /proc has no list."""
    found: list[int] = []
    for children in Path(f"/proc/{pid}/task").glob("*/children"):
        with contextlib.suppress(OSError):
            for child in map(int, children.read_text(encoding="ascii").split()):
                found += [child, *_descendants(child)]
    return found


class Process:
    """A child process with captured output that :meth:`stop` always ends."""

    def __init__(
        self,
        name: str,
        arguments: Sequence[str],
        environment: Mapping[str, str] | None = None,
        log: Path | None = None,
    ) -> None:
        """Start ``python -m MODULE ...`` or any other command line.

        Args:
            name: what to call it in messages.
            arguments: the command line; "python" stands for this interpreter.
            environment: of the child; None for this process's own.
            log: file that gets everything it prints, or None.
        """
        self.name = name
        self.lines: list[str] = []
        self._changed = threading.Condition()
        self._log = None if log is None else log.open("w", encoding="utf-8")
        command = [sys.executable if word == "python" else word for word in arguments]
        self._child = subprocess.Popen(
            command,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            errors="replace",
            env=None if environment is None else dict(environment),
        )
        self._reader = threading.Thread(target=self._read, name=f"{name}-output", daemon=True)
        self._reader.start()

    @property
    def pid(self) -> int:
        """Process id."""
        return self._child.pid

    @property
    def returncode(self) -> int | None:
        """Exit code, or None while it runs."""
        return self._child.poll()

    @property
    def text(self) -> str:
        """Everything it has printed."""
        with self._changed:
            return "\n".join(self.lines)

    def wait_for(self, fragment: str, timeout_s: float, *, after: int = 0) -> str:
        """Wait for a line that contains ``fragment``, from line number ``after`` on.

        Returns:
            The line.

        Raises:
            ProcessError: it ended, or it timed out.
        """
        deadline = time.monotonic() + timeout_s
        with self._changed:
            while True:
                for line in self.lines[after:]:
                    if fragment in line:
                        return line
                left_s = deadline - time.monotonic()
                ended = self._child.poll() is not None and not self._reader.is_alive()
                if ended or left_s <= 0.0:
                    break
                self._changed.wait(min(left_s, 0.1))
        why = f"exited with {self.returncode}" if ended else f"did not within {timeout_s:g} s"
        raise ProcessError(
            f"{self.name} should have printed '{fragment}' but {why}. It printed:\n"
            + "\n".join(self.lines[-20:])
        )

    def wait(self, timeout_s: float) -> int:
        """Wait for the end and return the exit code.

        Raises:
            ProcessError: it is still running after ``timeout_s``.
        """
        try:
            code = self._child.wait(timeout_s)
        except subprocess.TimeoutExpired:
            raise ProcessError(
                f"{self.name} was still running after {timeout_s:g} s. It printed:\n"
                + "\n".join(self.lines[-20:])
            ) from None
        self._close()
        return code

    def signal(self, number: signal.Signals) -> None:
        """Send a signal if it still runs."""
        if self._child.poll() is None:
            self._child.send_signal(number)

    def stop(self, timeout_s: float = 5.0) -> int:
        """End it: SIGINT, then after ``timeout_s`` SIGKILL, to what it has started too.

        Returns:
            The exit code.
        """
        self.signal(signal.SIGINT)
        try:
            self._child.wait(timeout_s)
        except subprocess.TimeoutExpired:
            started = _descendants(self._child.pid)
            self._child.kill()
            for pid in started:
                with contextlib.suppress(ProcessLookupError):
                    os.kill(pid, signal.SIGKILL)
            self._child.wait(10.0)
        self._close()
        return self._child.returncode

    def _close(self) -> None:
        self._reader.join(5.0)
        # Something that it has left behind may hold its output open, so the reader closes it:
        # closing it here would wait for the reader, without end and deaf to signals.
        with self._changed:
            if self._log is not None:
                self._log.close()
                self._log = None

    def _read(self) -> None:
        assert self._child.stdout is not None
        with self._child.stdout as output:
            for line in output:
                with self._changed:
                    self.lines.append(line.rstrip("\n"))
                    if self._log is not None:
                        self._log.write(line)
                        self._log.flush()
                    self._changed.notify_all()
        with self._changed:
            self._changed.notify_all()
