"""Nav2's interface to the server's actions: an ordinary client of them, in a process of its own."""
