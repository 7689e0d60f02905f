"""``ros2 service``: call."""

from __future__ import annotations

import argparse

from drone_navigation.ros2.session import Session, interface
from drone_navigation.ros2.values import filled, read_yaml

__all__ = ["call"]

_ENDED = "The service has ended; what became of the request is unknown."


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
    session.wait_for_answer(answer, client.service_is_ready, _ENDED)
    print(f"response:\n{answer.result()!r}\n")
    return 0
