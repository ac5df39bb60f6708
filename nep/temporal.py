"""`python -m nep.bench temporal`, by a name of its own."""

from nep.bench.suites.temporal import main
from simulator.process import run_main

if __name__ == "__main__":
    run_main(main)
