"""A memory as a database of SQLite: one process writes it, and any number read."""
