"""What is trained and played for the table of temporal networks, and the table."""
