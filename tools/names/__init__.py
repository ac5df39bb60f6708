"""How often a question is taken for what was meant."""
