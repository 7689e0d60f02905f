"""What a log holds for a report: its records, and the one track and figures of a vehicle."""
