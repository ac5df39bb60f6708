"""Homes in which things move while somebody is there, along ways, and lie still between."""
