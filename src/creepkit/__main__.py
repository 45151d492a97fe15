"""`python -m creepkit`: the command line."""

from creepkit.cli import main

main()
