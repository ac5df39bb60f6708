"""What a robot asks of a memory: rankings, searches, plans; for any policy, without torch."""
