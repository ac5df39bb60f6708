"""The Node Edge Predictor and its training."""
