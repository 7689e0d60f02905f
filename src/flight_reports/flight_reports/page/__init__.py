"""The page of a report: HTML, and the data of its plots."""
