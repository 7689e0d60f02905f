"""Agents that propose flights by the Model Context Protocol, and people who confirm them.

`acts.py`, `envelopes.py`, `rules.py`, `proposals.py` and `tool_calls.py` hold the rules: no ROS, no
I/O, no clock. `vehicle_view.py` and `vehicle_hands.py` see and fly the vehicle, `stdio_server.py`
speaks with the agent, `confirmations.py` with the person, `navigation_mcp.py` is the command.
"""
