"""State of the console: readouts and the selected control."""
