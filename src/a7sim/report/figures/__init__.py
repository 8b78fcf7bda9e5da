"""Figures of a report, drawn from the results."""
