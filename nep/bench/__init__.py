"""Games that players are scored in, one cache of scores, and tables of them.

A `Suite` lists games and players, and says what its table is made of;
`python -m nep.bench SUITE` plays what has not been played yet and writes it.
"""
