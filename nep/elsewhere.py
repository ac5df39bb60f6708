"""`python -m nep.bench elsewhere`, by a name of its own; in a checkout."""

import sys

from nep.bench.__main__ import main
from simulator.process import run_main

if __name__ == "__main__":
    run_main(lambda: main(["elsewhere", *sys.argv[1:]]))
