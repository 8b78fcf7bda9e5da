"""Training: exercises as data, attempts at them, and grades that a student can act on (decision 14)."""
