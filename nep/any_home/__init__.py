"""The network for any home: what a memory says of every place, compared as a set."""
