"""Where things are kept: P(furniture | room) and P(object, relation | furniture, room)."""
