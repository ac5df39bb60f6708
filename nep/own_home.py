"""`python -m nep.bench own_home`, by a name of its own."""

from nep.bench.suites.own_home import main
from simulator.process import run_main

if __name__ == "__main__":
    run_main(main)
