"""How the console is served over HTTP and WebSocket."""
