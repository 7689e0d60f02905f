"""Input and output: clocks, links, recordings, and the thread that runs them."""
