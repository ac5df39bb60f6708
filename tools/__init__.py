"""What built files that ship, and studies: run from a checkout, in no wheel.

`priors` counts packages and data sets into prior files, `text_training` trains the text vectors.
`bench` plays suites of games. `realism` compares how homes behave, `names` counts how questions
are understood, `eyes` what robots' eyes are right about, `searches` how soon searches
find things, `elsewhere` what finders know of things that are out. `measure_design` measures
rulings of docs/design.md.
"""
