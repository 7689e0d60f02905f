"""The thread that runs an application on a router.

One thread owns the router and the application, so nothing in them needs a lock. It waits for
the links, for a wake-up from other threads, or for the application's next deadline, whichever
comes first; then it does a bounded amount of work and waits again.

**When the application raises.** The message or timer that caused it is dropped, the exception
goes to `on_error`, and the thread continues: a mistake in handling one message must not leave a
flying vehicle without its HEARTBEATs and setpoints. But when the timers fail again and again,
nobody is steering any more, and HEARTBEATs would only hide that from the autopilot. The driver
then gives up: it sends nothing further, closes the links and says so, and the autopilot's own
failsafe for a lost ground station takes over.
"""

from __future__ import annotations

import functools
import logging
import select
import socket
import threading
from collections.abc import Callable, Mapping
from typing import Protocol, runtime_checkable

from mavlink_vehicle.codec import Intake, Message, Received, message_of
from mavlink_vehicle.errors import DriverError
from mavlink_vehicle.io.backlog import STALE_S, without_stale
from mavlink_vehicle.io.clock import Clock
from mavlink_vehicle.io.links.link import MAX_READS
from mavlink_vehicle.io.mailbox import Mailbox
from mavlink_vehicle.io.router import Router

OnError = Callable[[Exception], None]

GIVE_UP_S = 2.0
"""Timers may fail for this long, without one that works between, before the driver gives up."""

PAUSE_S = 0.05
"""A timer that failed, or that leaves its deadline where it was, is called again after this."""

_STALL_S = 0.5
# The receive buffer of a socket holds some thousand packets, which take a tenth of this.
_DRAIN_S, _DRAIN_READS = 0.25, 100
_LONGEST_WAIT_S = 60.0
_MAX_POSTS = 256


class Application(Protocol):
    """An application run by a driver. All methods are called on the driver's thread."""

    def start(self, now: float) -> None:
        """Begin."""

    def receive(self, message: Message, now: float) -> None:
        """Process a message that came by a vehicle link."""

    def overhear(self, message: Message, now: float) -> None:
        """Record what a ground station sent by a station link; it may be for a vehicle."""

    def handle_timer(self, now: float) -> None:
        """Do what is due."""

    def next_deadline(self) -> float | None:
        """Return when `handle_timer` wants to be called."""

    def messages_to_send(self) -> list[Message]:
        """Return and clear what is to be sent."""


@runtime_checkable
class TakesMeasurements(Protocol):
    """An application that takes measurements straight from their frames."""

    def intakes(self, system: int, component: int) -> Mapping[int, Intake]:
        """Return the intakes of a sender, by message number; other numbers come as messages.

        Nothing that an intake takes gives the application anything to send, or a nearer deadline.
        """


class Patience:
    """For how long that which must continue (timers, deadlines, messages) has been failing."""

    def __init__(self) -> None:
        """Begin without a failure."""
        self._since_s: float | None = None

    @property
    def failing(self) -> bool:
        """Whether it has failed and not worked since."""
        return self._since_s is not None

    def worked(self) -> None:
        """Note that it works (again)."""
        self._since_s = None

    def fail(self, now: float, rate: float = 1.0) -> float | None:
        """Note a failure; return for how long it has failed in s once that is too long.

        Args:
            now: time in seconds.
            rate: seconds of ``now`` in a second.
        """
        if self._since_s is None:
            self._since_s = now
        failing_s = (now - self._since_s) / rate
        return failing_s if failing_s >= GIVE_UP_S else None


def _log_error(error: Exception) -> None:
    logging.getLogger(__name__).error("The application failed.", exc_info=error)


class Driver(Mailbox):
    """Runs an application on a router in a thread of its own.

    Attributes:
        wait: waits for the links, for at most a number of ms; a trace of the turns replaces it.
    """

    def __init__(
        self,
        application: Application,
        router: Router,
        clock: Clock,
        on_error: OnError = _log_error,
    ) -> None:
        """Put them together; `start` begins.

        Args:
            application: what is run.
            router: where messages come from and go to; the driver closes it.
            clock: the application's time.
            on_error: called on the driver's thread with exceptions of the application and of
                posted callables; the traceback is in the exception.
        """
        super().__init__("driver")
        self._application = application
        self._router = router
        if isinstance(application, TakesMeasurements):
            router.find_intakes = application.intakes
        self._clock = clock
        self._on_error = on_error
        self._stopping = False
        self._closed = False
        self._patience = Patience()
        self._handled_deadline: float | None = None
        # Not epoll: it forgets a descriptor that a link closes and opens again under the same
        # number, without a sign. And not a selector: that takes three times as long.
        self._poll = select.poll()
        self.wait: Callable[[float], object] = self._poll.poll
        self._registered: tuple[int, ...] = ()
        self._wake_lock = threading.Lock()
        self._awake = False
        self._wake_read, self._wake_write = socket.socketpair()
        self._wake_read.setblocking(False)
        self._wake_write.setblocking(False)
        self._poll.register(self._wake_read, select.POLLIN)

    def start(self) -> None:
        """Start the thread.

        Raises:
            DriverError: it was started before.
        """
        if self.thread is not None:
            raise DriverError("This driver has already been started; create a new one.")
        self.thread = threading.Thread(target=self._run, name="vehicle-driver", daemon=True)
        self.thread.start()

    def stop(self, timeout_s: float = 5.0) -> None:
        """Stop the thread and close links and recording; stopping twice is harmless.

        Raises:
            DriverError: the thread did not end in time.
        """
        self._stopping = True
        self.wake()
        thread = self.thread
        if thread is None:
            self._close()
            return
        if thread is threading.current_thread():
            return  # it ends after this turn
        thread.join(timeout_s)
        if thread.is_alive():
            raise DriverError(f"The driver's thread did not end within {timeout_s} s.")

    # On the driver's thread

    def _run(self) -> None:
        try:
            self._guard(lambda: self._application.start(self._clock.now()))
            while not self._stopping:
                try:
                    self._turn()
                except Exception as error:
                    self._fail(error, self._clock.now())
            self._flush()
        finally:
            self._close()

    def _turn(self) -> None:
        """Wait for the next thing to do, and do it."""
        now = self._clock.now()
        link_deadline = self._router.poll(now)
        deadline = self._application_deadline(now)
        self._register()
        self.wait(self._wait_ms(now, link_deadline, deadline))
        if self._awake:
            self._drain_wake_ups()
        for _ in range(min(len(self.works), _MAX_POSTS)):
            self._guard(self.do_next)
        now = self._clock.now()
        self._hand_over(self._receive(now), self._application.receive, now)
        if deadline is not None and deadline <= now:
            self._run_timer(deadline, now)
        late_s = self._clock.now()
        if late_s - now > _STALL_S:
            # The machine hung meanwhile: the application must learn so before its messages from
            # before the hang are sent.
            self._run_timer(late_s, late_s)
        self._flush()
        # Frames for ground stations are forwarded after the vehicle's, however many there are.
        if self._router.has_stations:
            now = self._clock.now()
            self._hand_over(self._router.overhear(now), self._application.overhear, now)
            self._flush()

    def _receive(self, now: float) -> list[Received]:
        """Return what has come by vehicle links.

        When much waits, all of it is read, so that the newest is known, and stale telemetry is
        skipped. A flood may take `_DRAIN_S` at most.
        """
        messages = self._router.receive(now)
        if len(messages) < MAX_READS:
            return messages
        end_s = now + _DRAIN_S * self._clock.rate
        for _ in range(_DRAIN_READS):
            more = self._router.receive(now)
            messages += more
            if not more or self._clock.now() >= end_s:
                break
        return without_stale(messages, STALE_S * self._clock.rate)

    def _hand_over(
        self, messages: list[Received], receive: Callable[[Message, float], None], now: float
    ) -> None:
        for message in messages:
            try:
                if isinstance(message, tuple):
                    _, intake, data, frame = message
                    if intake(data, now):
                        continue
                    message = message_of(frame)  # noqa: PLW2901
                receive(message, now)
            except Exception as error:
                self._report(error)

    def _wait_ms(self, now: float, link_deadline: float | None, deadline: float | None) -> float:
        if self.works:
            return 0.0
        wait_s = PAUSE_S if self._patience.failing else _LONGEST_WAIT_S
        for time in (link_deadline, deadline):
            if time is not None:
                wait_s = min(wait_s, (time - now) / self._clock.rate)
        if wait_s > 0.0:
            return wait_s * 1e3
        # A deadline that has just been handled and is still there must not spin the processor.
        if self._patience.failing or deadline == self._handled_deadline:
            return PAUSE_S * 1e3
        return 0.0

    def _application_deadline(self, now: float) -> float | None:
        try:
            return self._application.next_deadline()
        except Exception as error:
            self._fail(error, now)
            return None

    def _run_timer(self, deadline: float, now: float) -> None:
        self._handled_deadline = deadline
        try:
            self._application.handle_timer(now)
        except Exception as error:
            self._fail(error, now)
        else:
            self._patience.worked()

    def _flush(self) -> None:
        """Send what the application has to send."""
        try:
            messages = self._application.messages_to_send()
        except Exception as error:
            self._fail(error, self._clock.now())
            return
        for message in messages:
            self._guard(functools.partial(self._router.send, message))
        self._guard(self._router.flush)

    def _guard(self, work: Callable[[], object]) -> None:
        try:
            work()
        except Exception as error:
            self._report(error)

    def _fail(self, error: Exception, now: float) -> None:
        self._report(error)
        failing_s = self._patience.fail(now, self._clock.rate)
        if failing_s is not None:
            self._stopping = True
            self._report(
                DriverError(
                    f"The application has been failing for {failing_s:.1f} s; the driver has "
                    "stopped and sends nothing more, so that the autopilot's own failsafe can act."
                )
            )

    def _report(self, error: Exception) -> None:
        try:
            self._on_error(error)
        except Exception as second:
            _log_error(second)

    def _register(self) -> None:
        """Let the selector follow the links' file descriptors, which come and go."""
        wanted = self._router.filenos()
        if wanted == self._registered:
            return
        for number in self._registered:
            self._poll.unregister(number)
        for number in wanted:
            self._poll.register(number, select.POLLIN)
        self._registered = wanted

    def wake(self) -> None:
        """Have the thread stop waiting; called by any thread."""
        with self._wake_lock:
            if self._awake or self._closed:
                return
            self._awake = True
            self._wake_write.send(b"w")

    def _drain_wake_ups(self) -> None:
        with self._wake_lock:
            self._awake = False
            self._wake_read.recv(16)

    def _close(self) -> None:
        with self._wake_lock:
            if self._closed:
                return
            self._closed = True
            self._wake_read.close()
            self._wake_write.close()
        self._router.close()
        self.drop_calls()
