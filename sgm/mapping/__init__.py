"""From frames to a map: `FurnitureMapper` draws the furniture that a detector names."""
