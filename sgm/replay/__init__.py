"""What is made of the log of a memory: the memory again, one that outlives its process."""
