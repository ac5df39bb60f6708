"""`python -m nep.bench paper`, by a name of its own."""

from nep.bench.suites.paper import main
from simulator.process import run_main

if __name__ == "__main__":
    run_main(main)
