"""What a memory says about an object that is asked for: counts, beliefs and features of places."""
