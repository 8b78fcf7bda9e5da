"""Training: exercises as data, attempts at them, and grades with instructions for the student (decision 14)."""
