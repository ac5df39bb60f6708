"""`python -m simulator.igridson play | run | video`."""

from simulator.igridson.command import main

if __name__ == "__main__":
    raise SystemExit(main())
