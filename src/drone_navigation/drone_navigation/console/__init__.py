"""The console: a page in the browser that is a client of the navigation server.

`access.py`, `lease.py`, `messages.py` and `shown_values.py` hold the rules: no ROS, no I/O, no
clock. `plans.py` and `page_values.py` convert. `vehicle.py`, `requests.py` and `fleet.py` are the
ROS client, in a thread of its own; `web.py` and `session.py` are the web server, in an event loop.
`rehearsing/` has goals simulated before they are sent; `page/` is what the browser gets.
"""
