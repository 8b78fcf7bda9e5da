"""Studies: a scenario worked as often as a question needs, factor by factor, and what comes of it in numbers."""
