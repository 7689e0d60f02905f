"""MAVLink 2 signing, against pymavlink and the rules of mavlink.io's page on it."""

from __future__ import annotations

import hashlib
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mavlink_vehicle.codec import Codec, Message, make, mavlink
from mavlink_vehicle.errors import LinkError
from mavlink_vehicle.io.signing_key import read_signing_key
from mavlink_vehicle.signing import Signing
from tests.support.messages.random_messages import CLASSES, random_message

KEY = hashlib.sha256(b"correct horse battery staple").digest()
EPOCH_UNIX_S = 1_420_070_400
NOW_UNIX_S = EPOCH_UNIX_S + 360_000_000.0
NOW = 36_000_000_000_000
MINUTE = 6_000_000


def server(key: bytes = KEY, unix_s: float = NOW_UNIX_S) -> Signing:
    return Signing(key, lambda: unix_s)


def station(
    key: bytes | None = KEY, timestamp: int = NOW, link_id: int = 0, system: int = 255
) -> mavlink.MAVLink:
    """Somebody else, with pymavlink's own signing."""
    other = mavlink.MAVLink(None, srcSystem=system, srcComponent=190)
    other.signing.secret_key = key
    other.signing.sign_outgoing = key is not None
    other.signing.timestamp = timestamp
    other.signing.link_id = link_id
    return other


def command(sender: mavlink.MAVLink, number: int = 400) -> bytes:
    return bytes(make("COMMAND_LONG", command=number, param1=1.0).pack(sender))


def counts(codec: Codec) -> tuple[int, int, int, int]:
    """Taken, unsigned, wrongly signed, replayed."""
    found = codec.statistics
    return found.frames, found.unsigned, found.badly_signed, found.replayed


@pytest.mark.parametrize("cls", CLASSES[::5], ids=lambda cls: cls.msgname)
def test_pymavlink_takes_what_is_signed_here_and_the_other_way_round(cls: type[Message]) -> None:
    message = random_message(cls, 1)
    reader = mavlink.MAVLink(None)
    reader.signing.secret_key = KEY
    frame = Codec(1, 191, server()).encode(message)
    assert reader.decode(bytearray(frame))._signed
    codec = Codec(1, 191, server())
    assert len(codec.decode(message.pack(station()))) == 1
    assert counts(codec) == (1, 0, 0, 0)


@given(st.binary(min_size=32, max_size=32), st.integers(0, 2**48 - 1), st.data())
def test_one_changed_bit_spoils_a_frame(key: bytes, timestamp: int, data: st.DataObject) -> None:
    frame = bytearray(command(station(key, timestamp)))
    bit = data.draw(st.integers(0, 8 * len(frame) - 1))
    frame[bit // 8] ^= 1 << bit % 8
    codec = Codec(1, 191, Signing(key, lambda: timestamp / 1e5 + EPOCH_UNIX_S))
    assert codec.decode(bytes(frame)) == []
    assert counts(codec)[0] == 0


def test_time_is_that_of_the_clock_and_grows_with_every_frame() -> None:
    signing = server()
    codecs = [Codec(1, 191, signing), Codec(1, 191, signing)]
    codecs[1].link_id = 1
    frames = [codec.encode(make("HEARTBEAT")) for codec in codecs * 2]
    times = [int.from_bytes(frame[-12:-6], "little") for frame in frames]
    assert times == [NOW, NOW + 1, NOW + 2, NOW + 3]
    assert [frame[-13] for frame in frames] == [0, 1, 0, 1]


def test_the_clock_may_stand_before_2015_or_at_the_end_of_time() -> None:
    for unix_s, first in ((0.0, 1), (1e15, 2**48 - 1)):
        frame = Codec(1, 191, server(unix_s=unix_s)).encode(make("HEARTBEAT"))
        assert int.from_bytes(frame[-12:-6], "little") == first


def test_unsigned_and_wrongly_signed_frames_are_dropped_and_counted_apart() -> None:
    codec = Codec(1, 191, server())
    mavlink_1 = make("COMMAND_LONG").pack(station(None), force_mavlink1=True)
    unknown = bytes([0xFD, 1, 0, 0, 0, 255, 190]) + (54321).to_bytes(3, "little") + bytes(3)
    assert codec.decode(command(station(None)) + bytes(mavlink_1) + unknown) == []
    assert counts(codec) == (0, 3, 0, 0)
    assert codec.decode(command(station(bytes(32)))) == []
    assert counts(codec) == (0, 3, 1, 0)
    assert codec.statistics.unknown == codec.statistics.bad_crc == 0


def test_a_radio_may_report_without_a_signature() -> None:
    codec = Codec(1, 191, server())
    radio = make("RADIO_STATUS", rssi=100)
    assert len(codec.decode(radio.pack(station(None)))) == 1
    assert codec.decode(radio.pack(station(bytes(32)))) == [], "but not with a wrong one"
    assert counts(codec) == (1, 0, 1, 0)


def test_a_replay_is_dropped_by_whatever_endpoint_it_comes() -> None:
    signing = server()
    codec, other = Codec(1, 191, signing), Codec(1, 191, signing)
    sender = station()
    first, second = command(sender), command(sender)
    assert len(codec.decode(second)) == 1
    assert codec.decode(second + first) == []
    assert other.decode(second) == []
    assert (counts(codec), counts(other)) == ((1, 0, 0, 2), (0, 0, 0, 1))
    assert len(other.decode(command(sender))) == 1


def test_a_forged_time_shuts_nobody_out() -> None:
    codec = Codec(1, 191, server())
    sender = station()
    assert codec.decode(command(station(bytes(32), NOW + 10**9))) == []
    assert len(codec.decode(command(sender))) == 1
    assert counts(codec) == (1, 0, 1, 0)


@pytest.mark.parametrize(("late", "taken"), [(MINUTE, 1), (MINUTE + 1, 0)])
def test_a_new_stream_may_be_one_minute_behind(late: int, taken: int) -> None:
    codec = Codec(1, 191, server())
    assert len(codec.decode(command(station(timestamp=NOW - late)))) == taken
    assert counts(codec) == (taken, 0, 0, 1 - taken)


def test_a_stream_is_a_system_a_component_and_a_link() -> None:
    codec = Codec(1, 191, server())
    assert len(codec.decode(command(station(timestamp=NOW + 100)))) == 1
    assert len(codec.decode(command(station(link_id=1)))) == 1
    assert len(codec.decode(command(station(system=254)))) == 1


def test_our_time_follows_the_latest_that_is_heard() -> None:
    signing = server()
    codec = Codec(1, 191, signing)
    codec.decode(command(station(timestamp=NOW + 10 * MINUTE)))
    assert signing.next_timestamp() == NOW + 10 * MINUTE + 1
    assert codec.decode(command(station(link_id=1, timestamp=NOW))) == [], "now long ago"


def test_a_vehicle_without_a_clock_is_heard_once_it_has_heard_us() -> None:
    """It begins at its stored time, and takes ours over from a HEARTBEAT."""
    vehicle = station(timestamp=NOW - 100 * MINUTE, system=1)
    codec = Codec(1, 191, server())
    assert codec.decode(command(vehicle)) == []
    vehicle.decode(bytearray(codec.encode(make("HEARTBEAT"))))
    assert len(codec.decode(command(vehicle))) == 1


def test_streams_are_bounded_and_what_is_forgotten_is_still_no_way_in() -> None:
    codec = Codec(1, 191, server())
    first = command(station(link_id=7, system=9))
    assert len(codec.decode(first)) == 1
    for number in range(2000):
        sender = station(
            timestamp=NOW + 1 + number, link_id=number % 256, system=10 + number // 256
        )
        assert len(codec.decode(command(sender))) == 1
    assert codec.decode(first) == []
    assert counts(codec) == (2001, 0, 0, 1)


def test_without_a_key_signatures_are_not_looked_at_and_nothing_is_signed() -> None:
    codec = Codec(1, 191)
    frame = command(station(bytes(32)))
    assert len(codec.decode(frame + frame + command(station(None)))) == 3
    assert counts(codec) == (3, 0, 0, 0)
    assert codec.encode(make("HEARTBEAT"))[2] == 0


def test_only_what_is_believed_is_observed_and_never_the_key() -> None:
    observed: list[bytes] = []
    codec = Codec(1, 191, server())
    codec.frame_observer = observed.append
    sender = station()
    good = command(sender)
    unknown = good[:7] + (54321).to_bytes(3, "little") + good[10:-6]
    unknown += hashlib.sha256(KEY + unknown).digest()[:6]
    codec.decode(unknown + command(station(None)) + good + command(station(bytes(32))))
    assert observed == [unknown], "the second has the time of the first"
    codec.decode(bytes(make("SETUP_SIGNING", secret_key=KEY).pack(sender)))
    assert len(observed) == 1
    assert codec.statistics.frames == 1


@pytest.mark.parametrize(
    ("content", "key"),
    [
        (KEY.hex(), KEY),
        (KEY.hex().upper() + "\r\n", KEY),
        ("correct horse battery staple\n", KEY),
        (KEY.hex()[:-1], hashlib.sha256(KEY.hex()[:-1].encode()).digest()),
        ("schlüssel", hashlib.sha256("schlüssel".encode()).digest()),
    ],
)
def test_a_key_file_holds_digits_or_a_passphrase(tmp_path: Path, content: str, key: bytes) -> None:
    path = tmp_path / "key"
    path.write_bytes(content.encode())
    path.chmod(0o600)
    assert read_signing_key(str(path)) == (key, None)


@pytest.mark.parametrize("mode", [0o640, 0o604])
def test_a_key_file_that_others_can_read_is_warned_of(tmp_path: Path, mode: int) -> None:
    path = tmp_path / "key"
    path.write_text("passphrase")
    path.chmod(mode)
    _, warning = read_signing_key(str(path))
    assert warning is not None
    assert "is readable by other users" in warning
    assert "passphrase" not in warning


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "is empty; write 64 hexadecimal digits or a passphrase"),
        (b" \n", "is empty"),
        (b"one\ntwo\n", "has several lines"),
        (b"\xff\xfe", "is not text in UTF-8"),
        (b"x" * 5000, "is larger than 4096 bytes"),
        (b"0" * 64, "all zeros"),
    ],
)
def test_a_file_without_a_key_is_rejected_in_a_sentence(
    tmp_path: Path, content: bytes, words: str
) -> None:
    path = tmp_path / "key"
    path.write_bytes(content)
    with pytest.raises(LinkError, match=f"signing_key_file: .*{words}"):
        read_signing_key(str(path))


def test_a_key_file_that_is_none_is_rejected_in_a_sentence(tmp_path: Path) -> None:
    with pytest.raises(LinkError, match=r"cannot read .*No such file"):
        read_signing_key(str(tmp_path / "nothing"))
    with pytest.raises(LinkError, match="is not a file"):
        read_signing_key(str(tmp_path))
    with pytest.raises(LinkError, match="cannot read"):
        read_signing_key("\0")


def test_a_key_of_another_size_is_rejected() -> None:
    with pytest.raises(ValueError, match="32 bytes, not 31"):
        Signing(bytes(31), lambda: NOW_UNIX_S)
