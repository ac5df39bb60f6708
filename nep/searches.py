"""`python -m nep.bench searches`, by a name of its own."""

from nep.bench.suites.searches import main
from simulator.process import run_main

if __name__ == "__main__":
    run_main(main)
