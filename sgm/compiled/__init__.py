"""Inner loops that numba compiles: a module here for each module of `sgm` that calls it.

Importing one of them loads numba, so callers import it where they use it, not at their top.
`kernel` compiles a function when it is first called, which takes about a second, and keeps the
machine code on disk for the processes that follow. That store notices changes of the file that a
function stands in, and of no other: a kernel calls functions of its own file alone. Arguments are
C-contiguous arrays of one dtype each; others would be compiled anew.
"""
