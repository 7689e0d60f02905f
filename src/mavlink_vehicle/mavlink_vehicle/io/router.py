"""Between a link and an application: decodes, encodes, records."""

from __future__ import annotations

from mavlink_vehicle.codec import Codec, Message
from mavlink_vehicle.io.links import Link
from mavlink_vehicle.io.tlog import TlogWriter


class Router:
    """One link with its codec and, if wanted, a recording of both directions."""

    def __init__(self, link: Link, codec: Codec, recorder: TlogWriter | None = None) -> None:
        """Put them together."""
        self.link = link
        self.codec = codec
        self._recorder = recorder
        self._failure_told = False
        if recorder is not None:
            codec.frame_observer = recorder.write

    def receive(self) -> list[Message]:
        """Return the messages that have come."""
        messages: list[Message] = []
        for data in self.link.receive():
            messages += self.codec.decode(data)
        return messages

    def send(self, message: Message) -> None:
        """Send a message.

        Raises:
            MessageError: it can't be encoded.
        """
        frame = self.codec.encode(message)
        if self._recorder is not None:
            self._recorder.write(frame)
        self.link.send(frame)

    def flush(self) -> None:
        """Hand the recording to the operating system.

        Raises:
            LinkError: the recording has ended for want of space or the like; raised once.
        """
        if self._recorder is None:
            return
        self._recorder.flush()
        if self._recorder.failure is not None and not self._failure_told:
            self._failure_told = True
            raise self._recorder.failure

    def close(self) -> None:
        """Close the link and the recording."""
        self.codec.frame_observer = None
        self.link.close()
        if self._recorder is not None:
            self._recorder.close()
