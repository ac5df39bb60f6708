"""All that changes an answer after the network, each with its number, unit and reason."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Corrections:
    """Numbers between the logits of a network, or the scores of any policy, and a ranking.

    In the order in which they are applied. What a network was fitted to is not here, but in its
    `config.json`: `prior_share`. What is learnt of a home is in `Leaving` and `Adaptation`, the
    miss rate of a robot in its `Detector`.

    Attributes:
        decimals: of a logit. Sums in another order differ nine orders of magnitude below, so that
            an answer does not depend on who shares the batch.
        prior_rate: moves per hour within a room of the filter that uses the prior, the last
            sighting and the looks since: a thing is soon elsewhere.
        prior_anywhere: share of its moves that lead anywhere, whatever the prior says.
        prior_gain: times `prior_share` more for that filter where the prior has told well where
            things are: counted in other homes it knows more than the sightings of a first week.
        lift_from, lift_to: nats that a prior gives the places of things more than an even guess
            does, on average in this home, from which and up to which it is trusted more.
        known_from, known_to: likewise the share of what one would know that is sure of all places.
        prior_sightings: that the prior counts as in a second filter of it, which reads all
            sightings.
        other_sightings: spread over all places in that filter.
        prior_second: share of that second filter where the prior is trusted in full.
        own_sightings: of a thing that halve the trust in the prior about it: then its own places
            say more.
        asked_weight: share of what Bayes' rule says of other questions than those that the network
            was trained on: it is learnt from questions of which half are about what has just
            moved. Best of .25, .4, .5 and .6 in validation homes. In others it gains .03 nats where
            little moves, else .01 or nothing, and loses .03 where much moves (results/notes.md).
        anywhere: share of a finder's belief that is spread over all places: nothing that was seen
            rules a place out.
        elsewhere_share: share of what is asked for that is at no known place: one search in ten.
        looks_counted: share of what negative looks of earlier steps say that is in the scores of a
            policy already if it reads the counters of the memory.
        usual_looks: that the usual miss rate counts as beside a robot's own count, which is too
            low: what is missed for long is often elsewhere when it is seen again.
        repeated_share: share of the misses that another look of the same time step repeats: what is
            hidden stays hidden.
        seen_now: probability of the place at which a thing was seen in this step: detectors err.
    """

    decimals: int = 6
    prior_rate: float = 0.5
    prior_anywhere: float = 0.03
    prior_gain: float = 9.0
    lift_from: float = 1.5
    lift_to: float = 2.0
    known_from: float = 0.5
    known_to: float = 0.6
    prior_sightings: float = 16.0
    other_sightings: float = 0.1
    prior_second: float = 0.5
    own_sightings: float = 20.0
    asked_weight: float = 0.4
    anywhere: float = 0.05
    elsewhere_share: float = 0.1
    looks_counted: float = 0.5
    usual_looks: float = 1000.0
    repeated_share: float = 0.2
    seen_now: float = 0.97


CORRECTIONS = Corrections()
