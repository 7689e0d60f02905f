from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from mavlink_vehicle.state.status_text import CHUNK_SIZE, StatusTexts, add_chunk, expire

LETTERS = st.characters(min_codepoint=32, max_codepoint=126)
TEXT = st.text(LETTERS, min_size=1, max_size=240)
LONG_TEXT = st.text(LETTERS, min_size=CHUNK_SIZE + 1, max_size=240)


def chunks_of(text: str) -> list[str]:
    """As a sender cuts it: the last chunk is not full, if need be it is empty."""
    pieces = [text[at : at + CHUNK_SIZE] for at in range(0, len(text), CHUNK_SIZE)]
    return [*pieces, ""] if len(pieces[-1]) == CHUNK_SIZE else pieces


@given(st.lists(TEXT, min_size=1, max_size=4), st.data())
def test_chunks_in_any_order_and_doubled_give_each_text_once(
    texts: list[str], data: st.DataObject
) -> None:
    packets = [
        (number, chunk, piece)
        for number, text in enumerate(texts, start=1)
        for chunk, piece in enumerate(chunks_of(text))
    ]
    doubled = packets + data.draw(st.lists(st.sampled_from(packets), max_size=6))
    state = StatusTexts()
    for sequence, (number, chunk, piece) in enumerate(data.draw(st.permutations(doubled))):
        state = add_chunk(
            state, severity=4, text=piece, text_id=number, chunk=chunk, sequence=sequence, now=1.0
        )
    assert sorted(t.text for t in state.texts) == sorted(text.strip() for text in texts)
    assert state.count == len(texts)


@given(LONG_TEXT, st.data())
def test_whatever_is_lost_the_text_comes_out_once(text: str, data: st.DataObject) -> None:
    pieces = list(enumerate(chunks_of(text)))
    kept = data.draw(st.lists(st.sampled_from(pieces), unique=True, min_size=1))
    state = StatusTexts()
    for chunk, piece in kept:
        state = add_chunk(
            state, severity=4, text=piece, text_id=9, chunk=chunk, sequence=chunk, now=1.0
        )
    state = expire(state, 10.0)
    assert state.count == 1
    assert ("[...]" in state.texts[0].text) == (len(kept) < len(pieces)) or "[...]" in text
    assert expire(state, 20.0) is state
