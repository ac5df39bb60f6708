"""`python -m nep.bench any_home`, by a name of its own."""

from nep.bench.suites.any_home import main
from simulator.process import run_main

if __name__ == "__main__":
    run_main(main)
