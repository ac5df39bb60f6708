"""Tables, figures and statistics of scores."""
