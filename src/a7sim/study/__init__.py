"""Monte Carlo studies: a scenario is run for many seeds and factor levels; the results are statistics."""
