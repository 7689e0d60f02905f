"""`navigation_server --check`: looks at a vehicle and its link, and moves nothing."""
