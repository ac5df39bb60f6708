"""What the paper claims, settled: which networks are trained and played, and the report."""
