"""How the shipped text pipeline was trained, once: `python -m simulator.text.train --out DIR`."""
