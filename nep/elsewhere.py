"""`python -m nep.bench elsewhere`, by a name of its own."""

from nep.bench.suites.elsewhere import main
from simulator.process import run_main

if __name__ == "__main__":
    run_main(main)
