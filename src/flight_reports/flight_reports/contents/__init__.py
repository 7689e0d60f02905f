"""Contents of a log for reports and pictures: its records, a vehicle's track and its figures."""
