"""The suites, a file each: games, players and table."""
