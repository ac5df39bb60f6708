"""Node Edge Predictor: which remembered or supposed edges of a home are true now."""

import os

# Waiting threads sleep rather than spin. When another process has one of two cores, spinning made a
# training step four times slower. Read when torch is loaded, hence here.
os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")
