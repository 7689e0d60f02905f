"""One autopilot over MAVLink, without ROS: usable alone.

    vehicle = Vehicle(VehicleConfig())
    router = Router([open_link("udpin://127.0.0.1:14550")], lambda: Codec(1, 191))
    driver = Driver(vehicle, router, clock := MonotonicClock())
    driver.start()
    driver.call(lambda: vehicle.change_mode("GUIDED", clock.now()))
    event = driver.call(vehicle.next_event)  # OperationFinished(... ACHIEVED ...), in time

`Vehicle` (vehicle.py) does no I/O and gets the time as an argument; `Driver` (io/driver.py) runs
it, or an application that holds it, on a router and its links. docs/protocols.md describes what
happens on the wire.
"""
