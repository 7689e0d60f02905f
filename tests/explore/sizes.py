"""The largest container within an object, to see that nothing grows without bound."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator

_PACKAGES = ("navigation_bridge", "navigation_core", "mavlink_vehicle")
_CONTAINERS = (list, dict, set, deque)


def largest(root: object) -> tuple[str, int]:
    """Return the name and the length of the largest container reached from an object of ours."""
    best, seen = ("nothing", 0), {id(root)}
    waiting: deque[tuple[str, object]] = deque([(type(root).__name__, root)])
    while waiting:
        name, value = waiting.popleft()
        if isinstance(value, _CONTAINERS) and len(value) > best[1]:
            best = (name, len(value))
        for inner_name, inner in _within(value):
            if id(inner) not in seen:
                seen.add(id(inner))
                waiting.append((f"{name}.{inner_name}" if inner_name else name, inner))
    return best


def _within(value: object) -> Iterator[tuple[str, object]]:
    if isinstance(value, dict):
        yield from (("", inner) for inner in value.values())
    elif isinstance(value, (*_CONTAINERS, tuple)):
        yield from (("", inner) for inner in value)
    elif type(value).__module__.startswith(_PACKAGES):
        yield from getattr(value, "__dict__", {}).items()
        slots = getattr(type(value), "__slots__", ())
        yield from ((slot, getattr(value, slot, None)) for slot in slots)
