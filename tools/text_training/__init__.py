"""How the shipped text pipeline was trained, once: `python -m tools.text_training --out DIR`."""
