"""Assembles the chunks of long STATUSTEXTs. Pure.

MAVLink cuts a text of more than 50 bytes into chunks with a common `id` and rising
`chunk_seq`; the last one has room for a NUL (https://mavlink.io/en/messages/common.html
#STATUSTEXT). Chunks may be lost, doubled or reordered on the way.

The id 0 stands for a text in one piece, but a PX4 counts its texts from 0 on each link, so that
its first text after a start may be cut and have the id 0 all the same (its STATUSTEXT stream;
observed). So a full chunk with the id 0 of a PX4 is kept until its continuation, or the patience,
is there. That of an ArduPilot is whole: "Auto mission changed but failed to restart command" has
50 bytes, and must not come late.
"""

from __future__ import annotations

from dataclasses import dataclass

CHUNK_SIZE = 50
KEPT_TEXTS = 20
PATIENCE_S = 1.5
"""How long missing chunks are waited for; then the text is given out with a gap."""


@dataclass(frozen=True, slots=True)
class StatusText:
    """One text of the autopilot.

    Attributes:
        time_s: when it was complete.
        severity: MAV_SEVERITY, 0 (emergency) to 7 (debug).
        text: the text; "[...]" stands where a chunk was lost.
    """

    time_s: float
    severity: int
    text: str


@dataclass(frozen=True, slots=True)
class _Partial:
    text_id: int
    severity: int
    started_s: float
    chunks: tuple[tuple[int, str], ...]  # sorted by chunk number
    done: bool = False  # complete; kept for a while so that late duplicates are known


@dataclass(frozen=True, slots=True)
class StatusTexts:
    """The last texts and those under way.

    Attributes:
        texts: the last 20, oldest first.
        count: how many there were since the start.
        partial: texts whose chunks are still coming, and recent complete ones.
        last_key: identity of the last text with the id 0, by which a doubled packet is known.
    """

    texts: tuple[StatusText, ...] = ()
    count: int = 0
    partial: tuple[_Partial, ...] = ()
    last_key: tuple[int, int, str] | None = None


def add_chunk(
    texts: StatusTexts,
    *,
    severity: int,
    text: str,
    text_id: int,
    chunk: int,
    sequence: int,
    now: float,
    counts_from_0: bool = False,
) -> StatusTexts:
    """Return the texts with one STATUSTEXT message added; the same object for a duplicate.

    Args:
        texts: what was there.
        severity: MAV_SEVERITY.
        text: the message's text.
        text_id: the common number of its chunks; 0 for a text in one piece, and for the first
            text of a PX4.
        chunk: chunk_seq.
        sequence: the packet's sequence number; a doubled packet has the same one.
        now: time in seconds.
        counts_from_0: whether a text with the id 0 may be cut, as a PX4's first.
    """
    last_key = texts.last_key
    if text_id == 0 and chunk == 0:
        key = (sequence, severity, text)
        if key == last_key:
            return texts
        last_key = key
        if len(text) < CHUNK_SIZE or not counts_from_0:
            whole = StatusText(now, severity, _clean(text))
            return StatusTexts(*_with(texts, whole), texts.partial, last_key)
        texts = _without_first(texts, now)
    partial = next((p for p in texts.partial if p.text_id == text_id), None)
    if partial is None:
        partial = _Partial(text_id, severity, now, ())
    if partial.done or any(number == chunk for number, _ in partial.chunks):
        return texts
    partial = _Partial(
        text_id, severity, partial.started_s, tuple(sorted((*partial.chunks, (chunk, text))))
    )
    others = tuple(p for p in texts.partial if p.text_id != text_id)
    if not _complete(partial):
        return StatusTexts(texts.texts, texts.count, (*others, partial), last_key)
    done = _Partial(text_id, severity, now, (), done=True)
    return StatusTexts(
        *_with(texts, StatusText(now, severity, _joined(partial))), (*others, done), last_key
    )


def _without_first(texts: StatusTexts, now: float) -> StatusTexts:
    """Give out a text with the id 0 that was waited for: another one begins."""
    waiting = next((p for p in texts.partial if p.text_id == 0), None)
    if waiting is None or (waiting.chunks and waiting.chunks[0][0] > 0):
        return texts  # its later chunks overtook its first
    others = tuple(p for p in texts.partial if p is not waiting)
    if waiting.done:
        return StatusTexts(texts.texts, texts.count, others, texts.last_key)
    text = StatusText(now, waiting.severity, _joined(waiting))
    return StatusTexts(*_with(texts, text), others, texts.last_key)


def expire(texts: StatusTexts, now: float) -> StatusTexts:
    """Give out what waited too long for lost chunks; the same object if nothing did."""
    if not any(now - p.started_s >= PATIENCE_S for p in texts.partial):
        return texts
    kept = []
    for partial in texts.partial:
        if now - partial.started_s < PATIENCE_S:
            kept.append(partial)
        elif not partial.done:
            text = StatusText(now, partial.severity, _joined(partial))
            texts = StatusTexts(*_with(texts, text), texts.partial, texts.last_key)
    return StatusTexts(texts.texts, texts.count, tuple(kept), texts.last_key)


def _with(texts: StatusTexts, text: StatusText) -> tuple[tuple[StatusText, ...], int]:
    return (*texts.texts, text)[-KEPT_TEXTS:], texts.count + 1


def _complete(partial: _Partial) -> bool:
    """Return whether the last chunk (one that isn't full) and all before it are there."""
    number, text = partial.chunks[-1]
    return len(text) < CHUNK_SIZE and number == len(partial.chunks) - 1


def _joined(partial: _Partial) -> str:
    pieces: list[str] = []
    expected = 0
    for number, text in partial.chunks:
        pieces.append("[...]" if number > expected else "")
        pieces.append(text)
        expected = number + 1
    whole = partial.text_id == 0 and expected == 1  # 50 bytes in one piece
    if len(partial.chunks[-1][1]) == CHUNK_SIZE and not whole:
        pieces.append("[...]")
    return _clean("".join(pieces))


def _clean(text: str) -> str:
    """Strip what firmwares put at the end (PX4 a TAB) and what a terminal must not get."""
    return "".join(c if c.isprintable() else " " for c in text).strip()
