"""`python -m a7sim`."""

from a7sim.cli import main

if __name__ == "__main__":
    main()
