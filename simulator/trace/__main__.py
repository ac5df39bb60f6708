"""`python -m simulator.trace`."""

import sys

from simulator.trace.command import main

if __name__ == "__main__":
    sys.exit(main())
