"""`python -m simulator.igridson play | video`."""

from simulator.igridson.command import main
from simulator.process import run_main

if __name__ == "__main__":
    run_main(main)
