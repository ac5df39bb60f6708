"""What patrols teach a robot of a home: `python -m tools.patrols --help`."""
