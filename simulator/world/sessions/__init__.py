"""Homes in which things move in sessions of residents, along ways, and lie still between."""
