"""Flies a scenario to its end."""

from __future__ import annotations

from collections.abc import Callable

from tests.explore.exploration import Exploration, Ship
from tests.explore.happenings import ACTIONS
from tests.explore.log import Entry, Log
from tests.explore.scenario import Event, Scenario

_END_S = 1500.0
"""Longest wait for the last goals to end once all is well again"""
_QUIET_S = 5.0


class EnoughError(Exception):
    """Raised by a watcher to end a flight."""


def fly(scenario: Scenario, watch: Callable[[Entry], None] | None = None) -> Log:
    """Fly it; all trouble ends with the last event, and then every goal must end.

    A goal that a ground station has paused waits for that station for as long as it takes: a client
    cancels it.

    Args:
        scenario: what happens.
        watch: is given each entry of the log; may raise EnoughError.
    """
    log = Log()
    if watch is not None:
        log.watch = watch
    try:
        _fly(scenario, log)
    except EnoughError:
        pass
    except Exception:
        if not any(e.kind == "server" and e.value == "failed" for e in log.entries):
            raise
    return log


def _fly(scenario: Scenario, log: Log) -> None:
    flight = Exploration(scenario, log)
    flight.ready()
    begun_s = flight.now_s
    for event in scenario.events:
        flight.run_for(max(0.0, begun_s + event.time_s - flight.now_s))
        happen(flight, event)
    for ship in flight.ships:
        _mend(ship)
    flight.run_until(lambda: not any(_flies(ship) for ship in flight.ships), _END_S)
    for ship in flight.ships:
        if _busy(ship):
            happen(flight, Event(0.0, ship.index, "cancel"))
    flight.run_until(lambda: not any(_busy(ship) for ship in flight.ships), _END_S)
    flight.run_for(_QUIET_S)
    for ship in flight.ships:
        ship.measure()


def happen(flight: Exploration, event: Event) -> None:
    """Let an event happen."""
    ship = flight.ships[event.craft]
    ship.log("happening", event)
    ACTIONS[event.what](ship, **event.how)


def _busy(ship: Ship) -> bool:
    return ship.server is not None and bool(ship.server.active)


def _flies(ship: Ship) -> bool:
    return _busy(ship) and ship.server is not None and not ship.server.paused


def _mend(ship: Ship) -> None:
    ship.sim.link.set_faults(None)
    ship.sim.link.silent = ship.sim.link.mute = False
    ship.sim.restore_gps("explored")
    ship.sim.shift_gps((0.0, 0.0, 0.0))
    ship.sim.lose_radio(False)
    ship.full = ship.blind = ship.unlocated = False
    ship.stuck = None
    ship.liars, ship.misreport = [], ""
    ship.met = []
    ship.start_server()
    ship.log("happening", Event(0.0, ship.index, "mended"))
