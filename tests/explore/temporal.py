"""Policies in temporal form: always, never, and within a time.

A policy reads a log entry by entry. Its function gets what it looks at, the view of that vehicle
(`course.View`) and the time; its docstring is its sentence.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Hashable
from dataclasses import dataclass, field, replace
from typing import Any

from tests.explore.course import View
from tests.explore.log import Entry


@dataclass(frozen=True)
class Select:
    """The entries that a policy looks at.

    Attributes:
        kind: of the entries.
        pick: returns what is looked at of an entry's value, or None.
        names: of the classes of these values, or the types of messages; empty for all.
    """

    kind: str
    pick: Callable[[Any], Any]
    names: tuple[str, ...] = ()

    def may_pick(self, kind: str, of: type) -> bool:
        """Whether it may select an entry of a kind whose value is of a class."""
        names = {getattr(each, "msgname", each.__name__) for each in of.__mro__}
        return kind == self.kind and (not self.names or not names.isdisjoint(self.names))

    def __call__(self, entry: Entry) -> Any:
        """Return what is looked at in an entry, or None."""
        return self.pick(entry.value) if entry.kind == self.kind else None


Holds = Callable[[Any, View, float], bool]
"""Of what was selected, the view of its vehicle, and the time in s."""
_registered: list[Policy] = []


@dataclass
class Policy(ABC):
    """A named predicate over a log.

    Attributes:
        name: that of its function.
        text: a sentence.
        source: where the rule comes from.
        form: "always", "never" or "within".
        looked: how often it had something to look at.
    """

    name: str
    text: str
    source: str
    form: str
    looked: int = field(default=0, init=False)

    def reads(self, kind: str, of: type) -> bool:
        """Whether it looks at entries of a kind whose value is of a class."""
        return True

    def fresh(self) -> Policy:
        """Return the same policy at the beginning of a log."""
        return replace(self)

    @abstractmethod
    def read(self, entry: Entry, view: View) -> str:
        """Take the next entry; return what is wrong, or nothing."""


@dataclass
class Steady(Policy):
    """Whenever something is selected, it holds; or never."""

    on: Select
    holds: Holds

    def reads(self, kind: str, of: type) -> bool:
        """See Policy."""
        return self.on.may_pick(kind, of)

    def read(self, entry: Entry, view: View) -> str:
        """See Policy."""
        value = self.on(entry)
        if value is None:
            return ""
        self.looked += 1
        is_sound = self.holds(value, view, entry.time_s) is (self.form == "always")
        return "" if is_sound else f"{value}"


@dataclass
class Within(Policy):
    """A policy: each thing that begins is over within a time.

    Attributes:
        begins: returns the key of what begins with an entry, or None.
        over: of the view, the key, its beginning and the time: whether it is over, or excused.
        seconds: the time, of the view.
    """

    begins: Callable[[Entry, View], Hashable | None]
    over: Callable[[View, Any, float, float], bool]
    seconds: Callable[[View], float]
    _due: dict[tuple[int, Hashable], float] = field(default_factory=dict, init=False)

    def read(self, entry: Entry, view: View) -> str:
        """See Policy."""
        now_s, wrong = entry.time_s, ""
        for (craft, key), begun_s in list(self._due.items()) if self._due else ():
            if craft != entry.craft or now_s - begun_s <= self.seconds(view):
                continue
            del self._due[craft, key]
            if not self.over(view, key, begun_s, now_s):
                wrong = f"{key}: nothing in {now_s - begun_s:.1f} s"
        begun = self.begins(entry, view)
        if begun is not None:
            self.looked += 1
            self._due.setdefault((entry.craft, begun), now_s)
        return wrong


def always(on: Select, source: str) -> Callable[[Holds], Holds]:
    """Whenever ``on`` selects something, the function holds."""

    def register(holds: Holds) -> Holds:
        _registered.append(Steady(*_named(holds), source, "always", on, holds))
        return holds

    return register


def never(on: Select, source: str) -> Callable[[Holds], Holds]:
    """Whenever ``on`` selects something, the function does not hold."""

    def register(holds: Holds) -> Holds:
        _registered.append(Steady(*_named(holds), source, "never", on, holds))
        return holds

    return register


def within(
    seconds: Callable[[View], float],
    begins: Callable[[Entry, View], Hashable | None],
    source: str,
) -> Callable[[Callable[[View, Any, float, float], bool]], Any]:
    """Register a function that judges, this time after a begin, whether it is over or excused."""

    def register(over: Callable[[View, Any, float, float], bool]) -> Any:
        _registered.append(Within(*_named(over), source, "within", begins, over, seconds))
        return over

    return register


def policies() -> tuple[Policy, ...]:
    """Return all that were registered."""
    return tuple(_registered)


def _named(function: Callable[..., Any]) -> tuple[str, str]:
    assert function.__doc__
    return function.__name__, " ".join(function.__doc__.split())


# --- selections ------------------------------------------------------------------------------


def output(*kinds: type) -> Select:
    """An output of the bridge."""
    names = tuple(kind.__name__ for kind in kinds)
    return Select("output", lambda value: value if isinstance(value, kinds) else None, names)


def sent(*types: str) -> Select:
    """A message that the server sent; without names, any."""
    return Select("sent", lambda m: m if not types or m.get_type() in types else None, types)


def of_kind(kind: str) -> Select:
    """An entry of a kind: "truth", "asked", "server"."""
    return Select(kind, lambda value: value)


def happens(what: str, entry: Entry) -> bool:
    """Whether an entry is a happening of a name."""
    return entry.kind == "happening" and entry.value.what == what
