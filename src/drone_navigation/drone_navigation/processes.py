"""Start, monitor and stop the processes of a flight; find free ports and ROS domains."""

from __future__ import annotations

import atexit
import contextlib
import math
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
from types import FrameType

_LOOPBACK = "127.0.0.1"
_DOMAIN_MAX = 101
# Where the first participant of a domain receives discovery traffic (DDSI-RTPS 2.3,
# 9.6.1.1: port base 7400, domain gain 250, offset d1 10), and a port that no participant uses.
_PORT_BASE, _DOMAIN_GAIN, _OFFSET, _RESERVING_OFFSET = 7400, 250, 10, 5
_PORT_MIN, _PORT_MAX, _PORTS_TRIED = 61000, 65500, 100
# A hundred times what an idle machine needs, and how often the wait is told.
_READY_TIMEOUT_S, _TELL_S = 600.0, 5.0
_READER_S = 5.0
_POLL_S = 0.05
# A program that was interrupted ends within 5 s, and so does each that it has started.
_END_LIMIT_S = 4.5


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

    It is reserved while this process lives: two programs that look at the same moment find
    different ones, and one that starts nodes now and then meets no others in between.

    Raises:
        ProcessError: all domains are taken.
    """
    for offset in range(_DOMAIN_MAX):
        domain = 1 + (start + offset) % _DOMAIN_MAX
        first_port = _PORT_BASE + _DOMAIN_GAIN * domain
        reservation = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            try:
                probe.bind(("", first_port + _OFFSET))
                reservation.bind((_LOOPBACK, first_port + _RESERVING_OFFSET))
            except OSError:
                reservation.close()
                continue
        atexit.register(reservation.close)
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
        return "\n".join(self.lines)

    def wait_for(self, fragment: str, timeout_s: float, *, after: int = 0) -> str:
        """Wait for a line that contains ``fragment``, from line number ``after`` on.

        Returns:
            The line.

        Raises:
            ProcessError: it ended, or it timed out.
        """
        # An interrupt may end this wait at any point, so it holds no lock.
        deadline = time.monotonic() + timeout_s
        while True:
            ended = self._child.poll() is not None and not self._reader.is_alive()
            for line in self.lines[after:]:
                if fragment in line:
                    return line
            if ended or time.monotonic() >= deadline:
                break
            time.sleep(_POLL_S)
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
        self._reader.join(_READER_S)
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
        return self.end_within(timeout_s)

    def end_within(self, timeout_s: float) -> int:
        """Wait for its end; kill it, and what it has started, after ``timeout_s``.

        Returns:
            The exit code.
        """
        try:
            self._child.wait(timeout_s)
        except subprocess.TimeoutExpired:
            started = _descendants(self._child.pid)
            self._child.kill()
            for pid in started:
                with contextlib.suppress(ProcessLookupError):
                    os.kill(pid, signal.SIGKILL)
            self._child.wait(10.0)
        # Something that it has left behind may hold its output open.
        self._reader.join(_READER_S)
        return self._child.returncode

    def _read(self) -> None:
        assert self._child.stdout is not None
        with self._child.stdout as output, self._log or contextlib.nullcontext() as log:
            for line in output:
                self.lines.append(line.rstrip("\n"))
                if log is not None:
                    log.write(line)
                    log.flush()


class ProcessGroup:
    """Processes that a program starts, and that end with it, all within 5 s.

    From its creation on SIGINT and SIGTERM raise KeyboardInterrupt, once. One that comes while a
    process is being started, or while all are stopped, is seen afterwards: none is left behind.
    """

    def __init__(self, logs: Path | None = None) -> None:
        """Take the signals; called by the main thread.

        Args:
            logs: folder for what the processes print, or None.
        """
        self._logs = logs
        self._processes: list[Process] = []
        self._in_terminal: subprocess.Popen[bytes] | None = None
        self._holds = self._is_interrupted = self._is_held_back = False
        self._end_by_s = math.inf
        # An interrupt may come between the last step of a program and `__exit__`.
        atexit.register(self._stop)
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, self._interrupt)

    def __enter__(self) -> ProcessGroup:
        """Return itself."""
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        """Stop all processes.

        Raises:
            KeyboardInterrupt: it came meanwhile.
        """
        self._stop()
        if kind is None and self._is_held_back:
            raise KeyboardInterrupt

    def start(
        self, name: str, command: Sequence[str], environment: Mapping[str, str] | None = None
    ) -> Process:
        """Start a process; the arguments are those of `Process`."""
        log = None if self._logs is None else self._logs / f"{name}.log"
        with self._held():
            process = Process(name, command, environment, log)
            self._processes.append(process)
        return process

    def start_vehicle(self, server: Sequence[str], simulator: Sequence[str]) -> dict[str, str]:
        """Start a navigation server and its simulator, on a link and in a ROS domain of their own.

        Progress is printed.

        Args:
            server: arguments of the server, but for the link.
            simulator: those of the simulator.

        Returns:
            The environment of the server's clients, once it is ready for goals.

        Raises:
            ProcessError: one of them failed.
        """
        begin_s = time.monotonic()
        print(
            "Starting a simulated vehicle and a navigation server; wait some seconds.", flush=True
        )
        environment = ros_environment(free_domain(os.getpid()))
        link = f"//127.0.0.1:{free_udp_port()}"
        words = ["python", "-m", "drone_navigation.navigation_server"]
        words += ["--link", f"udpin:{link}", *server]
        process = self.start("navigation_server", words, environment)
        words = ["python", "-m", "mavlink_sitl", "--link", f"udpout:{link}", *simulator]
        self.start("mavlink_sitl", words, environment)
        self._wait_until_ready(process, begin_s)
        print(f"Ready after {time.monotonic() - begin_s:.1f} s", flush=True)
        return environment

    @staticmethod
    def _wait_until_ready(process: Process, begin_s: float) -> None:
        """Wait for a server that is ready for goals, as long as it runs, and tell its last line."""
        while True:
            try:
                process.wait_for("Position valid", _TELL_S)
            except ProcessError:
                waited_s = time.monotonic() - begin_s
                if process.returncode is not None or waited_s > _READY_TIMEOUT_S:
                    raise
                last = process.lines[-1].rpartition("]: ")[2] if process.lines else "no output yet"
                print(f"{waited_s:.0f} s, still starting: {last}", flush=True)
            else:
                return

    def run_in_terminal(
        self,
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
            ProcessError: it is still running after ``timeout_s``, or after an interrupt.
        """
        with self._held():
            # The terminal interrupts it, too. While Python starts, that would be a fatal error of
            # Python's; the programs let it through (`process_control.quiet_start`).
            mask = signal.pthread_sigmask(signal.SIG_BLOCK, (signal.SIGINT,))
            try:
                child = subprocess.Popen([sys.executable, "-m", *arguments], env=dict(environment))
            finally:
                signal.pthread_sigmask(signal.SIG_SETMASK, mask)
            self._in_terminal = child
        try:
            return child.wait(timeout_s)
        except subprocess.TimeoutExpired:
            raise ProcessError(f"{arguments[0]} did not end within {timeout_s:g} s") from None
        except KeyboardInterrupt:
            if not ends_itself:
                raise
            self._signal()
            try:
                # Told twice, by the terminal and by this program, it may end by the signal itself.
                return max(child.wait(max(self._end_by_s - time.monotonic(), 0.0)), 0)
            except subprocess.TimeoutExpired:
                raise ProcessError(f"{arguments[0]} did not end after an interrupt") from None

    def _signal(self) -> None:
        """Interrupt all processes at once, as a terminal does."""
        if self._end_by_s < math.inf:
            return
        self._end_by_s = time.monotonic() + _END_LIMIT_S
        if self._in_terminal is not None and self._in_terminal.poll() is None:
            self._in_terminal.send_signal(signal.SIGINT)
        for process in self._processes:
            process.signal(signal.SIGINT)

    def _stop(self) -> None:
        """Stop all processes; an interrupt is seen afterwards."""
        self._holds = True
        child = self._in_terminal
        if child is not None and child.poll() is None and self._end_by_s == math.inf:
            child.kill()
        self._signal()
        while self._processes:
            self._processes.pop().end_within(max(self._end_by_s - time.monotonic(), 0.0))
        if child is not None and child.poll() is None:
            child.kill()
            child.wait()

    @contextlib.contextmanager
    def _held(self) -> Iterator[None]:
        """Hold an interrupt back."""
        self._holds = True
        try:
            yield
        finally:
            self._holds = False
        if self._is_held_back:
            raise KeyboardInterrupt

    def _interrupt(self, _number: int, _frame: FrameType | None) -> None:
        if self._is_interrupted:
            return
        self._is_interrupted = True
        self._is_held_back = self._holds
        if not self._holds:
            raise KeyboardInterrupt
