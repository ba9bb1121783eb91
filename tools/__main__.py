"""Run the command line from a checkout: `python -m tools`."""

from tools.cli import main

main()
