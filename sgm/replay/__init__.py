"""What is made of the events of a memory: it again, also beside the process that writes it."""
