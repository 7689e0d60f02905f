"""``ros2 service``: list and call."""

from __future__ import annotations

import argparse

from drone_navigation.ros2.session import CommandError, Session, interface, is_hidden, print_names
from drone_navigation.ros2.values import filled, read_yaml

__all__ = ["call", "list_services"]

# While a server is discovered in part, rmw_fastrtps takes a service for none.
_GONE_S = 3.0


def list_services(session: Session, options: argparse.Namespace) -> int:
    """Print the names of all services."""
    session.discover()
    found = session.node.get_service_names_and_types()
    return print_names([(n, t) for n, t in found if options.all or not is_hidden(n)], options)


def call(session: Session, options: argparse.Namespace) -> int:
    """Call a service and print its response."""
    kind = interface("srv", options.type)
    request = filled(kind.Request, read_yaml(options.values))
    client = session.node.create_client(kind, options.name)
    if not client.service_is_ready():
        print("waiting for service to become available...", flush=True)
        session.wait(client.service_is_ready)
    print(f"requester: making request: {request!r}\n", flush=True)
    answer = client.call_async(request)
    while not session.wait(answer.done, _GONE_S):
        if not session.wait(lambda: answer.done() or client.service_is_ready(), _GONE_S):
            raise CommandError("The service has ended; what became of the request is unknown.")
    print(f"response:\n{answer.result()!r}\n")
    return 0
