"""Run the command line from a checkout: `python -m tools`."""

from tools.start import main

if __name__ == "__main__":  # a bench's processes import this file again
    main()
