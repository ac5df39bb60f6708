"""True homes: what is where, how it changes, what a look shows."""
