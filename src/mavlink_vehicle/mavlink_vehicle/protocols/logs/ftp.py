"""MAVFTP: requests and answers of FILE_TRANSFER_PROTOCOL, and one request at a time.

https://mavlink.io/en/services/ftp.html. Only what reads is here; nothing is ever written, renamed
or removed.
"""

from __future__ import annotations

import enum
import struct
from dataclasses import dataclass

from mavlink_vehicle.codec import Message, make, mavlink
from mavlink_vehicle.protocols.operations.command import Address

__all__ = ["DATA_BYTES", "FTP_MESSAGE", "FtpAnswer", "FtpError", "FtpLine", "FtpOp", "FtpQuestion"]

FTP_MESSAGE = mavlink.MAVLink_file_transfer_protocol_message
DATA_BYTES = 239
_HEADER = struct.Struct("<HBBBBBxI")
_ACK, _NAK = 128, 129
_SEQUENCES = 1 << 16
# An ArduPilot opens files of 5 sessions in one thread beside its main loop; a PX4 at once.
_AGAIN_S = 1.0
_ATTEMPTS = 12


class FtpOp(enum.IntEnum):
    """The operation of a request (MAVLink FTP opcodes)."""

    TERMINATE = 1
    LIST = 3
    OPEN_TO_READ = 4
    READ = 5


class FtpError(enum.IntEnum):
    """Why a request was rejected; others count as `FAIL`."""

    FAIL = 1
    FAIL_ERRNO = 2
    INVALID_SESSION = 4
    NO_SESSIONS = 5
    END_OF_FILE = 6
    UNKNOWN_COMMAND = 7
    NOT_FOUND = 10


@dataclass(frozen=True)
class FtpAnswer:
    """An answer.

    Attributes:
        sequence: that of the request, plus 1.
        session: of the autopilot.
        op: what was asked for; numbers that are not ours are no answers to us.
        offset: of the data in the file.
        data: at most 239 bytes.
        error: why it was rejected; None if it was not.
    """

    sequence: int
    session: int
    op: FtpOp
    offset: int
    data: bytes
    error: FtpError | None

    @classmethod
    def of(cls, message: Message, address: Address) -> FtpAnswer | None:
        """Return the answer to us in a message; None if it is none, or makes no sense."""
        if message.__class__ is not FTP_MESSAGE:
            return None
        target = (message.target_system, message.target_component)
        if target != (address.source_system, address.source_component):
            return None
        payload = bytes(message.payload)
        sequence, session, op, size, asked, _, offset = _HEADER.unpack_from(payload)
        if op not in (_ACK, _NAK) or size > DATA_BYTES:
            return None
        data = payload[_HEADER.size : _HEADER.size + size]
        error = None
        if op == _NAK:
            number = data[0] if data else 0
            error = FtpError(number) if number in set(FtpError) else FtpError.FAIL
        try:
            return cls(sequence, session, FtpOp(asked), offset, data, error)
        except ValueError:
            return None


class FtpLine:
    """Numbers and addresses requests.

    An autopilot that gets the number of its last answer again takes it for a repetition and answers
    the same, whatever is asked: so numbers begin with the time.
    """

    def __init__(self, address: Address, now: float) -> None:
        """Begin.

        Args:
            address: of the conversation.
            now: time in seconds.
        """
        self.address = address
        self.session = 0
        self._sequence = 2 * int(now * 500.0) % _SEQUENCES

    def request(
        self, op: FtpOp, offset: int = 0, size: int | None = None, data: bytes = b""
    ) -> tuple[int, Message]:
        """Return a request and the number that its answer has.

        Args:
            op: what is asked for.
            offset: in a file, or the number of entries to skip.
            size: of what is to be read; by default that of the data.
            data: a path.
        """
        number = self._sequence
        # An answer has the next number; the autopilot takes the same number for a repetition.
        self._sequence = (number + 2) % _SEQUENCES
        size = len(data) if size is None else size
        payload = _HEADER.pack(number, self.session, op, size, 0, 0, offset) + data
        message = make(
            "FILE_TRANSFER_PROTOCOL",
            target_network=0,
            target_system=self.address.target_system,
            target_component=self.address.target_component,
            payload=list(payload.ljust(_HEADER.size + DATA_BYTES, b"\0")),
        )
        return (number + 1) % _SEQUENCES, message


class FtpQuestion:
    """One request, repeated until it is answered.

    Attributes:
        answer: the answer, once it is there.
        gave_up: whether there was none after all repetitions.
    """

    def __init__(self, line: FtpLine, op: FtpOp, offset: int = 0, path: str = "") -> None:
        """Prepare; `handle_timer` asks."""
        self.answer: FtpAnswer | None = None
        self.gave_up = False
        self._op = op
        self._number, self._message = line.request(op, offset, data=path.encode())
        self._attempts = 0
        self._due_s = 0.0

    def receive(self, answer: FtpAnswer) -> None:
        """Take an answer, if it is the one."""
        is_mine = answer.sequence == self._number and answer.op is self._op
        if is_mine and self.answer is None:
            self.answer = answer

    @property
    def deadline_s(self) -> float | None:
        """When to ask again."""
        return None if self.answer is not None or self.gave_up else self._due_s

    def handle_timer(self, now: float) -> Message | None:
        """Return the request if it is to be sent now; the same one is answered the same."""
        deadline = self.deadline_s
        if deadline is None or now < deadline:
            return None
        self._attempts += 1
        if self._attempts > _ATTEMPTS:
            self.gave_up = True
            return None
        self._due_s = now + _AGAIN_S
        return self._message
