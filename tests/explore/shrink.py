"""Makes a scenario smaller while it still violates the same policy."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

from tests.explore.scenario import Craft, Event, Scenario

_USUAL = ("battery", "chatty", "signed", "firmware", "camera", "gimbal", "search_s", "home")
"""Of a vehicle: what is tried as it usually is, in this order"""


def shrink(
    scenario: Scenario, fails: Callable[[Scenario], bool], tries: int = 200
) -> tuple[Scenario, int]:
    """Return the smallest scenario that was found, and how many were flown.

    Args:
        scenario: one that fails.
        fails: flies one and returns whether it violates the policy.
        tries: how many may be flown.
    """
    flown = 0
    again = True
    while again:
        again = False
        for smaller in _smaller(scenario):
            if flown >= tries:
                return scenario, flown
            flown += 1
            if fails(smaller):
                scenario, again = smaller, True
                break
    return scenario, flown


def _smaller(scenario: Scenario) -> Iterator[Scenario]:
    """Yield what is simpler, the boldest first."""
    if len(scenario.crafts) > 1:
        yield from (_alone(scenario, index) for index in range(len(scenario.crafts)))
    yield from _shorter(scenario)
    if scenario.posts:
        half = len(scenario.posts) // 2
        yield replace(scenario, posts=())
        yield from (replace(scenario, posts=part)
                    for part in (scenario.posts[:half], scenario.posts[half:]) if half)  # fmt: skip
    if any(scenario.wind_ned_m_s) or scenario.gust_m_s:
        yield replace(scenario, wind_ned_m_s=(0.0, 0.0, 0.0), gust_m_s=0.0)
    for index, craft in enumerate(scenario.crafts):
        for plainer in _plainer(craft):
            if scenario.shares_traffic and plainer.home != craft.home:
                continue  # it would stand on another one
            crafts = (*scenario.crafts[:index], plainer, *scenario.crafts[index + 1 :])
            yield replace(scenario, crafts=crafts)


def _shorter(scenario: Scenario) -> Iterator[Scenario]:
    """Leave out events, and let the rest begin at once."""
    events = scenario.events
    size = len(events) // 2
    while size >= 1:
        for begin in range(0, len(events), size):
            yield replace(scenario, events=events[:begin] + events[begin + size :])
        size //= 2
    if events and events[0].time_s > 1.0:
        early = tuple(replace(e, time_s=round(e.time_s - events[0].time_s, 2)) for e in events)
        yield replace(scenario, events=early)


def _alone(scenario: Scenario, index: int) -> Scenario:
    events = tuple(Event(e.time_s, 0, e.what, e.how) for e in scenario.events if e.craft == index)
    return replace(scenario, crafts=(scenario.crafts[index],), events=events)


def _plainer(craft: Craft) -> Iterator[Craft]:
    if craft.server:
        yield replace(craft, server={})
    for name in craft.server:
        yield replace(craft, server={k: v for k, v in craft.server.items() if k != name})
    for name in craft.onboard:
        yield replace(craft, onboard={k: v for k, v in craft.onboard.items() if k != name})
    usual = Craft()
    for name in _USUAL:
        if getattr(craft, name) != getattr(usual, name):
            yield replace(craft, **{name: getattr(usual, name)})
