"""Products, sums and softmax of rows that networks are made of."""
