"""A server that is being configured or cleaned up has not failed."""

from __future__ import annotations

import json
import subprocess
import sys

from drone_navigation.processes import free_udp_port, ros_environment
from tests.support.processes import HANGS_AFTER_S
from tests.support.ros.ros_flight import new_domain

# The main thread asks before the driver has been started, and after it has been stopped.
SOURCE = """
import json
import sys
import threading
import rclpy
from rclpy.parameter import Parameter
from drone_navigation.server.lifecycle import managed_server
from mavlink_vehicle.io.clock import MonotonicClock

rclpy.init()
values = {"link_url": sys.argv[1], "autostart": False}
server = managed_server.ManagedServer(
    [Parameter(name, value=value) for name, value in values.items()], [], True, MonotonicClock()
)
said, asking = [], []

def ask():
    asking.append(threading.Thread(target=lambda: said.append(server.running)))
    asking[-1].start()
    asking[-1].join(0.3)  # it may wait for the end of the transition

class Asked(managed_server.NavigationServer):
    def start(self, trace=None):
        ask()
        super().start(trace)

    def stop(self, beside=()):
        super().stop(beside)
        ask()

managed_server.NavigationServer = Asked
assert server.start()
server.node.trigger_configure()
server.node.trigger_cleanup()
for thread in asking:
    thread.join()
server.stop()
server.close()
rclpy.try_shutdown()
print(json.dumps(said))
"""


def test_a_driver_that_is_not_there_yet_or_any_more_has_not_failed() -> None:
    done = subprocess.run(
        [sys.executable, "-c", SOURCE, f"udpin://127.0.0.1:{free_udp_port()}"],
        env=ros_environment(new_domain()), check=False,
        capture_output=True, text=True, timeout=HANGS_AFTER_S,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout.splitlines()[-1]) == [True, True]
