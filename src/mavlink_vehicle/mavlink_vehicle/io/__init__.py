"""What touches the world: clocks, links, recordings, and the thread that runs it all."""
