"""`navigation_server --check`: checks a vehicle and its link without moving anything."""
