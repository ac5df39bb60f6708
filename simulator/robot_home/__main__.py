"""`python -m simulator.robot_home play`."""

from simulator.process import run_main
from simulator.robot_home.command import main

if __name__ == "__main__":
    run_main(main)
