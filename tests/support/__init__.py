"""Helpers of the tests, typed and checked like the package."""
