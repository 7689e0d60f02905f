"""Rehearses goals for another program: ``python -m flight_rehearsal``.

One JSON object per line. In: an order with a `number` (`order.py`). Out: first a greeting that
names the parameters to ask for; for each order its number with `rehearsal`, then with `lost`, or
with `error`. A newer order takes the place of an older one. It ends with its input.
"""

from __future__ import annotations

import gc
import json
import os
import sys
import threading
import time
from collections.abc import Iterable
from dataclasses import asdict
from typing import Any, TextIO

from flight_rehearsal.flight_parameters import SERVER_PARAMETERS, VEHICLE_PARAMETERS
from flight_rehearsal.rehearsal import StoppedError, lose_link, rehearse
from flight_rehearsal.request import RequestError, read_request

_GIVE_UP_S, _GIVE_UP_PLAN_S = 10.0, 60.0
_NICENESS = 5


class _Orders:
    """The lines that come in; only the newest counts."""

    def __init__(self, lines: Iterable[str]) -> None:
        self._lines = lines
        self._waiting: str | None = None
        self._ended = False
        self._changed = threading.Condition()
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self) -> None:
        for line in self._lines:
            with self._changed:
                self._waiting = line
                self._changed.notify()
        with self._changed:
            self._ended = True
            self._changed.notify()

    @property
    def superseded(self) -> bool:
        """Whether another one waits."""
        return self._waiting is not None

    def newest(self) -> str | None:
        """Wait for an order; None at the end."""
        with self._changed:
            self._changed.wait_for(lambda: self._waiting is not None or self._ended)
            line, self._waiting = self._waiting, None
        return line


def main() -> int:
    """Serve until the input ends."""
    os.nice(_NICENESS)  # what flies is more important
    orders = _Orders(sys.stdin)
    _tell(sys.stdout, server=SERVER_PARAMETERS, vehicle=VEHICLE_PARAMETERS)
    while (line := orders.newest()) is not None:
        # Nothing that one rehearsal makes is cyclic garbage worth looking for during it.
        gc.disable()
        _serve(line, orders)
        gc.enable()
        gc.collect()
    return 0


def _serve(line: str, orders: _Orders) -> None:
    number = None
    began_s, limit_s = time.monotonic(), _GIVE_UP_S

    def is_over() -> bool:
        return orders.superseded or time.monotonic() > began_s + limit_s

    try:
        number = json.loads(line).get("number")
        order = read_request(line)
        limit_s = _GIVE_UP_PLAN_S if order.steps else _GIVE_UP_S
        flown = rehearse(order, is_over)
        _tell(sys.stdout, number=number, rehearsal=_rounded(asdict(flown)))
        if flown.accepted and order.lose_link and not order.steps:
            lost = lose_link(order, 0.5 * flown.duration_s, is_over)
            _tell(sys.stdout, number=number, lost=_rounded(asdict(lost)))
    except StoppedError:
        if not orders.superseded:
            _tell(sys.stdout, number=number, error=f"It took longer than {limit_s:g} s.")
    except RequestError as error:
        _tell(sys.stdout, number=number, error=str(error))


def _rounded(value: Any) -> Any:
    """Return a result with its numbers to the centimetre, which is short."""
    if isinstance(value, dict):
        return {name: _rounded(each) for name, each in value.items()}
    if isinstance(value, (tuple, list)):
        return [_rounded(each) for each in value]
    return round(value, 2) if isinstance(value, float) else value


def _tell(out: TextIO, **message: Any) -> None:
    out.write(json.dumps(message) + "\n")
    out.flush()


if __name__ == "__main__":
    sys.exit(main())
