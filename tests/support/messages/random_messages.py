"""Messages of every class of the dialect with random values, made by pymavlink."""

from __future__ import annotations

import math
import random
from typing import Any

from mavlink_vehicle.codec import mavlink

CLASSES = [cls for number, cls in sorted(mavlink.mavlink_map.items()) if number >= 0]
USUAL_FLOATS = (0.0, 1.5, -2.25, 1e9)
STRANGE_FLOATS = (*USUAL_FLOATS, math.nan, math.inf, -math.inf, 3.4e38)
_RANGES = {"B": (0, 255), "b": (-128, 127), "H": (0, 65535), "h": (-32768, 32767)}
_RANGES |= {"I": (0, 2**32 - 1), "i": (-(2**31), 2**31 - 1)}
_RANGES |= {"Q": (0, 2**64 - 1), "q": (-(2**63), 2**63 - 1)}


def random_message(cls: Any, seed: int | str, floats: tuple[float, ...] = USUAL_FLOATS) -> Any:
    """Return a message of the class with random values in every field."""
    source = random.Random(f"{cls.msgname}:{seed}")
    values: dict[str, Any] = {}
    formats = cls.native_format.decode()[1:]
    for name, letter, length in zip(
        cls.ordered_fieldnames, formats, cls.array_lengths, strict=True
    ):
        count = max(length, 1)
        if letter == "c":
            values[name] = bytes(source.choices(b"ab \x00\xff", k=count))
            continue
        if letter in "fd":
            elements = [source.choice(floats) for _ in range(count)]
        else:
            elements = [source.randint(*_RANGES[letter]) for _ in range(count)]
        values[name] = elements if length else elements[0]
    return cls(*(values[name] for name in cls.fieldnames))
