"""A link without sockets, good or bad. Part of `simulation` (the same layer)."""

from __future__ import annotations

from collections.abc import Callable

from mavlink_sitl.links.faults import FaultyPipe, LinkFaults


class SimulatedLink:
    """The ground station's end of a vehicle's link, made by the vehicle.

    Args:
        seed: of the faults.
        receive: takes bytes that arrive at the vehicle, and whether they are a datagram.
        now_us: returns simulated time.
        on_change: called when `late` may have changed.

    Attributes:
        silent: while true, nothing passes in either direction.
        mute: the same for the vehicle's messages only.
        late: whether something may be under way in it.
    """

    def __init__(
        self,
        seed: str,
        faults: LinkFaults | None,
        receive: Callable[[bytes, bool], None],
        now_us: Callable[[], int],
        on_change: Callable[[], None],
    ) -> None:
        self.silent = False
        self.mute = False
        self._on_change = on_change
        self._seed = seed
        self._receive = receive
        self._now_us = now_us
        self._arrived: list[bytes] = []
        self.set_faults(faults)

    def set_faults(self, faults: LinkFaults | None) -> None:
        """Make the link bad from now on, or good; what is under way in it is lost."""
        self._up = self._down = None
        self.late = faults is not None
        self._on_change()
        if faults is not None:
            self._up = FaultyPipe(faults, f"{self._seed}:up")
            self._down = FaultyPipe(faults, f"{self._seed}:down")

    def write(self, data: bytes, datagram: bool = True) -> None:
        """Send bytes to the vehicle, now.

        Args:
            data: any number of whole frames, or anything else.
            datagram: a frame that is cut short ends here. False on a stream of bytes.
        """
        if self.silent:
            return
        if self._up is None:
            self._receive(data, datagram)
        else:
            self._up.push(data, self._now_us())
            self.pump()

    def read(self) -> bytes:
        """Everything the vehicle has sent since the last reading."""
        return b"".join(self.read_datagrams())

    def read_datagrams(self) -> list[bytes]:
        """The same, one frame per item."""
        arrived, self._arrived = self._arrived, []
        return arrived

    def pump(self) -> None:
        """Move on what is late; called by the vehicle at every tick."""
        now_us = self._now_us()
        if self._up is not None:
            for data in self._up.pop(now_us):
                if not self.silent:
                    self._receive(data, True)
        if self._down is not None:
            self._arrived += self._down.pop(now_us)

    def deliver(self, frame: bytes) -> None:
        """A frame from the vehicle; called by it."""
        if self.silent or self.mute:
            return
        if self._down is None:
            self._arrived.append(frame)
        else:
            self._down.push(frame, self._now_us())
