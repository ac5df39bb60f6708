"""How well finders know that things are out of the home: `python -m nep.bench.elsewhere`."""
