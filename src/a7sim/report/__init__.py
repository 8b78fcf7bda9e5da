"""Outputs from a session's folder: report, forms, cards, asciicast, comparisons."""
