"""How the shipped text pipeline was trained, once: `python -m datamodules.text.train --out DIR`."""
