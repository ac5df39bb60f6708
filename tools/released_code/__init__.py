"""What the authors' released code does otherwise, one switch each, and the order of networks."""
