"""`python -m a7sim`."""

from a7sim.cli import main

main()
