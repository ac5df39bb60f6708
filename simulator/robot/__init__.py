"""What a robot asks of a memory: names, rankings, searches, plans; for any policy, without torch."""
