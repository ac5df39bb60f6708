"""Things that are out of the home: homes, questions about them, and what finders said."""
