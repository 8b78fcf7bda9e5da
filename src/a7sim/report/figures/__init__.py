"""The figures of a report, each drawn from what the results say."""
