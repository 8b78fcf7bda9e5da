"""The console: the instrument for a person, on a terminal. It speaks only the command language."""
