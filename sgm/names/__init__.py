"""What a name of a thing or a place means."""
