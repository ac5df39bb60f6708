"""What the training of either network shares."""
