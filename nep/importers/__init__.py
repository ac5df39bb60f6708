"""Recorded homes of data sets that need torch to be read; `simulator.trace import` knows them."""
