"""The tables and the figure of the paper, from trainings and evaluations."""
