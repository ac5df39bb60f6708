"""Trained networks that read evidence alone, run by ONNX Runtime."""
