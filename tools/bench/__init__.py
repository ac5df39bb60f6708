"""Suites of games that make our pages: `python -m tools.bench SUITE`, in a checkout.

A suite lists games and players, and says what its table is made of. What has been played stays in
the JSON file beside the table.
"""
