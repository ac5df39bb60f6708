"""What players are scored in, the file that keeps their scores, and what plays the rest."""
