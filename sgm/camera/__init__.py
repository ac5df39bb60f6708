"""One frame of a camera: pose, depth, what is in view, and where in the map detections are."""
