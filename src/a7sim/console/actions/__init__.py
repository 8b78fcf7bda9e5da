"""Actions of the console, one module a group of keys."""
