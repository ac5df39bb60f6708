"""How homes behave over days, in numbers that recorded and simulated homes share."""

from tools.realism.measures import MEASURES, Behaviour, follow_homes, measure_behaviour

__all__ = ["MEASURES", "Behaviour", "follow_homes", "measure_behaviour"]
