"""Readers of the packages that the shipped prior was built from; none is needed to use it."""
