"""Node Edge Predictor: which remembered or supposed edges of a home are true now."""
