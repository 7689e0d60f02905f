"""Several hosts on this machine: network namespaces joined by a switch, for tests to cut.

Each host is a namespace of its own (its network, and its shared memory), so that nothing
passes between two of them but what goes over their cables. All live in one user namespace
of their own, which needs no rights; root does without where there can be none. The machine's
own network is not touched. They hold on to this process by a pipe and vanish with it.
"""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Mapping, Sequence

from tests.support.processes import Process

# A range for documentation (RFC 5737, TEST-NET-2): no machine has it.
_NETWORK = "198.51.100"
_TOOLS = ("ip", "unshare", "nsenter", "setpriv")
_STEP_TIMEOUT_S = 10.0
_CABLE = "eth0"
_UNSHARE = ("unshare", "--net", "--mount")


class NoNamespacesError(RuntimeError):
    """Hosts cannot be made here; the sentence says what was tried."""


class _Namespace:
    """A process that does nothing but hold namespaces open."""

    def __init__(self, name: str, command: Sequence[str], user: Sequence[str]) -> None:
        self.name = name
        self.user = user
        # `cat` ends when this process's end of the pipe is closed, whatever closes it.
        script = "mount -t tmpfs tmpfs /dev/shm && ip link set lo up && echo ready && exec cat"
        self._words = [*command, "sh", "-c", script]
        self._holder = subprocess.Popen(
            self._words,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        assert self._holder.stdout is not None
        if self._holder.stdout.readline() != "ready\n":
            raise NoNamespacesError(f"'{' '.join(self._words)}' failed: {self._end()}")

    @property
    def pid(self) -> int:
        return self._holder.pid

    def enter(self) -> list[str]:
        """Return what to put before a command that is to run in here."""
        return ["nsenter", "--target", str(self.pid), *self.user, "--net", "--mount", "--"]

    def run(self, *words: str) -> str:
        done = subprocess.run(
            [*self.enter(), *words],
            check=False,
            capture_output=True,
            text=True,
            timeout=_STEP_TIMEOUT_S,
        )
        if done.returncode != 0:
            raise NoNamespacesError(f"'{' '.join(words)}' in a namespace failed: {done.stderr}")
        return done.stdout

    def _end(self) -> str:
        self._holder.kill()
        _output, error = self._holder.communicate(timeout=_STEP_TIMEOUT_S)
        return " ".join(error.split())

    def close(self) -> None:
        self._end()


class Host(_Namespace):
    """One host: an address, a cable, and processes.

    Attributes:
        address: IPv4 address in the hosts' network.
    """

    def __init__(self, name: str, number: int, switch: _Namespace) -> None:
        """Make it, with a cable to ``switch`` at port ``number``."""
        super().__init__(name, [*switch.enter(), *_UNSHARE], switch.user)
        self.address = f"{_NETWORK}.{number}"
        self._switch = switch
        self._port = f"port{number}"
        peer = ("peer", "name", _CABLE, "netns", str(self.pid))
        switch.run("ip", "link", "add", self._port, "type", "veth", *peer)
        switch.run("ip", "link", "set", self._port, "master", "switch", "up")
        self.run("ip", "address", "add", f"{self.address}/24", "dev", _CABLE)
        self.run("ip", "link", "set", _CABLE, "up")

    def process(
        self, name: str, arguments: Sequence[str], environment: Mapping[str, str]
    ) -> Process:
        """Start a process here; it ends with this one at the latest."""
        words = [*self.enter(), "setpriv", "--pdeathsig", "KILL", "--", *arguments]
        return Process(f"{name} on {self.name}", words, environment)

    def unplug(self) -> None:
        """Cut the cable, at the switch: the host keeps its address and sees no carrier."""
        self._switch.run("ip", "link", "set", self._port, "down")

    def drop_multicast(self, drop: bool) -> None:
        """Keep multicast from this host."""
        flood = "off" if drop else "on"
        self._switch.run(
            "ip", "link", "set", self._port, "type", "bridge_slave", "mcast_flood", flood
        )

    def plug(self) -> None:
        """Mend the cable."""
        self._switch.run("ip", "link", "set", self._port, "up")

    def counted(self) -> tuple[int, int]:
        """Return the bytes that this host has received and sent over its cable."""
        for line in self.run("cat", "/proc/net/dev").splitlines():
            name, _, numbers = line.partition(":")
            if name.strip() == _CABLE:
                columns = numbers.split()
                return int(columns[0]), int(columns[8])
        raise AssertionError(f"{self.name} has no {_CABLE}")


class Network:
    """Hosts at a switch.

    Attributes:
        hosts: numbered from 1 in the order of their names.
    """

    def __init__(self, *names: str) -> None:
        """Make a host for each name.

        Raises:
            NoNamespacesError: namespaces are not allowed here, or a tool is missing.
        """
        missing = [tool for tool in _TOOLS if shutil.which(tool) is None]
        if missing:
            raise NoNamespacesError(f"no {' and no '.join(missing)} here (iproute2, util-linux)")
        self.hosts: list[Host] = []
        self._switch = _switch()
        try:
            # Without a querier a switch that snoops would drop the multicast of discovery.
            self._switch.run("ip", "link", "add", "switch", "type", "bridge", "mcast_snooping", "0")
            self._switch.run("ip", "link", "set", "switch", "up")
            for number, name in enumerate(names, 1):
                self.hosts.append(Host(name, number, self._switch))
        except BaseException:
            self.close()
            raise

    def drop_multicast(self, drop: bool) -> None:
        """Drop it at the switch, as many access points of Wi-Fi do, or pass it on again."""
        for host in self.hosts:
            host.drop_multicast(drop)

    def close(self) -> None:
        """Let all namespaces go; their processes are to be stopped before."""
        for host in (*self.hosts, self._switch):
            host.close()


def _switch() -> _Namespace:
    try:
        return _Namespace(
            "switch", [*_UNSHARE, "--user", "--map-root-user"], ["--user", "--preserve-credentials"]
        )
    except NoNamespacesError as error:
        if os.geteuid() != 0:
            raise
        first = error
    try:
        return _Namespace("switch", _UNSHARE, ())
    except NoNamespacesError as error:
        raise NoNamespacesError(f"{first}; as root {error}") from None


def networked(environment: Mapping[str, str]) -> dict[str, str]:
    """Return an environment whose nodes are found by the other hosts, too, and only over cables.

    Fast DDS takes namespaces of one machine for one host and would try shared memory.
    """
    return {
        **environment,
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET",
        "FASTDDS_BUILTIN_TRANSPORTS": "UDPv4",
    }
