"""The wall clock around a simulation, and its sockets.

One thread: it lets simulated time catch up with the wall clock times the speedup, hands on
what the vehicle says, and sleeps until the next tick or the next packet.
"""

from __future__ import annotations

import contextlib
import functools
import selectors
import socket
import time
from collections.abc import Callable

from mavlink_sitl.links.addresses import LinkAddress
from mavlink_sitl.links.camera_sender import CameraSender
from mavlink_sitl.links.endpoints import LinkError, OpenLink, open_endpoint
from mavlink_sitl.links.senders import Senders
from mavlink_sitl.simulation import TICK_US, Simulation

__all__ = ["LinkError", "Runner"]

BURST_S = 0.02
"""Longest time spent on the simulation before the sockets are looked at again"""
LAG_S = 0.5
"""Further behind the wall clock than this, the rest is given up"""
SHORTEST_SLEEP_S = 0.001


class Runner:
    """Runs a simulation against the wall clock.

    Args:
        addresses: where the vehicle speaks: one for each of its links, or, for a vehicle with
            one link, any number, and it says the same on all of them.
        speedup: simulated seconds per second.
        after_each: called after each piece of simulated time, to watch it.
        warn: called with a sentence when two ground stations have one system id.
        camera: where to send what the cameras see of the world's mark; None for nowhere.

    Raises:
        LinkError: a link cannot be opened.
    """

    def __init__(
        self,
        simulation: Simulation,
        addresses: list[LinkAddress],
        speedup: float,
        after_each: Callable[[], None],
        warn: Callable[[str], None] = lambda _: None,
        camera: LinkAddress | None = None,
    ) -> None:
        self._simulation = simulation
        self._speedup = speedup
        self._after_each = after_each
        self._warn = warn
        self._senders = Senders([vehicle.system_id for vehicle in simulation.vehicles])
        self._stop_requested = False
        self._selector = selectors.DefaultSelector()
        self._wake_in, self._wake_out = socket.socketpair()
        self._wake_in.setblocking(False)
        self._wake_out.setblocking(False)
        self._selector.register(self._wake_out, selectors.EVENT_READ, lambda: None)
        self.endpoints: list[OpenLink] = []
        self._camera: CameraSender | None = None
        try:
            for place, address in enumerate(addresses):
                receive = functools.partial(self._receive, place)
                self.endpoints.append(open_endpoint(address, receive))
            if camera is not None:
                self._camera = CameraSender(camera)
        except LinkError:
            self.close()
            raise
        for endpoint in self.endpoints:
            endpoint.register(self._selector)
        if self._camera is not None:
            self._camera.endpoint.register(self._selector)
        self._start_s = time.monotonic()

    def stop(self) -> None:
        """End `run` at once; may be called from a signal handler."""
        self._stop_requested = True
        with contextlib.suppress(OSError):  # a full buffer: already awake
            self._wake_in.send(b"x")

    def close(self) -> None:
        """Close all sockets."""
        for endpoint in self.endpoints:
            endpoint.close()
        if self._camera is not None:
            self._camera.endpoint.close()
        self._selector.close()
        self._wake_in.close()
        self._wake_out.close()

    def _due_us(self) -> int:
        return int((time.monotonic() - self._start_s) * self._speedup * 1e6)

    def _next_tick_us(self) -> int:
        return (self._simulation.time_us // TICK_US + 1) * TICK_US

    def _receive(self, place: int, data: bytes, peer: str) -> None:
        simulation = self._simulation
        warning = self._senders.hear(data, peer, time.monotonic())
        if warning is not None:
            self._warn(warning)
        simulation.run_to_us(min(self._due_us(), simulation.time_us + TICK_US))
        self._after_each()
        if self._stop_requested:
            return
        for vehicle in simulation.vehicles:  # who is not meant keeps silent
            links = vehicle.links
            links[place if len(links) > 1 else 0].write(data)
        self._send()

    def _send(self) -> None:
        for vehicle in self._simulation.vehicles:
            links = vehicle.links
            for place, link in enumerate(links):
                # A vehicle with one link says the same on all endpoints.
                to = self.endpoints if len(links) == 1 else self.endpoints[place : place + 1]
                for frame in link.read_datagrams():
                    for endpoint in to:
                        endpoint.send(frame)
        if self._camera is not None:
            self._send_sightings(self._camera)

    def _send_sightings(self, camera: CameraSender) -> None:
        simulation = self._simulation
        for row, vehicle in enumerate(simulation.vehicles):
            for sighting in simulation.sightings(row):
                age_us = (simulation.time_us - sighting.measured_us) / self._speedup
                now_us = time.time() * 1e6  # noqa: TID251 - what hears it has the time of day
                camera.send(vehicle.system_id, sighting, round(now_us - age_us))

    def run(self) -> None:
        """Run until `stop` is called."""
        self._start_s = time.monotonic() - self._simulation.time_s / self._speedup
        while not self._stop_requested:
            self._catch_up()
            wait_s = (self._next_tick_us() - self._due_us()) / 1e6 / self._speedup
            if wait_s > 0.0:
                wait_s = max(wait_s, SHORTEST_SLEEP_S)
            for key, _ in self._selector.select(max(wait_s, 0.0)):
                key.data()

    def _catch_up(self) -> None:
        simulation = self._simulation
        begun_s = time.monotonic()
        while self._next_tick_us() <= self._due_us() and not self._stop_requested:
            simulation.run_to_us(min(self._due_us(), simulation.time_us + 10 * TICK_US))
            self._send()
            self._after_each()
            if time.monotonic() - begun_s > BURST_S:
                break
        behind_s = (self._due_us() - simulation.time_us) / 1e6 / self._speedup
        if behind_s > LAG_S:
            self._start_s += behind_s
