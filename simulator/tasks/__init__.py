"""Tasks that are played in simulated homes."""
