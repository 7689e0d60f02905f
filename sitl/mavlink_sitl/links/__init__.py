"""Links: sockets, addresses, faults."""
