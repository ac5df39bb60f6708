"""A thing that comes to a place and leaves it: two states in continuous time, in closed form."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


def compute_presence(
    presence: np.ndarray, leave: np.ndarray, come: np.ndarray, steps: np.ndarray
) -> np.ndarray:
    """Return the probability that it is there after some steps without looks; all arrays broadcast.

    `presence` is that of now; the rates of leaving while it is there, positive, and of coming while
    it is not, are per step.
    """
    in_the_long_run = come / (leave + come)
    return in_the_long_run + (presence - in_the_long_run) * np.exp(-(leave + come) * steps)


@dataclass(frozen=True, slots=True)
class Interval:
    """What the look at the end of an interval says; arrays of the shape of its arguments.

    Attributes:
        presence: probability that it is there after the look.
        evidence: probability of what the look saw.
        departures: expected number of times that it left, given the look.
        arrivals: expected number of times that it came.
        time_present: expected number of steps that it was there.
    """

    presence: np.ndarray
    evidence: np.ndarray
    departures: np.ndarray
    arrivals: np.ndarray
    time_present: np.ndarray


def follow_interval(
    presence: np.ndarray,
    leave: np.ndarray,
    come: np.ndarray,
    steps: np.ndarray,
    if_present: np.ndarray,
    if_absent: np.ndarray,
) -> Interval:
    """Follow it from one look to the next; all arrays broadcast.

    Args:
        presence: probability that it was there after the look before.
        leave: rate of leaving while it is there, per step, positive.
        come: rate of coming while it is not there, per step, positive.
        steps: time between the looks, D below.
        if_present: probability of what the look saw if it is there.
        if_absent: the same if it is not there.

    With s = leave + come, p = come / s, q = leave / s and e = exp(-s D), the probability to be
    there after u steps is p + q exp(-s u) from there and p - p exp(-s u) from elsewhere. The
    expected steps there that start in state i and end in j are the integral over u of
    P(i -> there, u) P(there -> j, D - u), and the expected departures are `leave` times that of
    P(i -> there, u) P(not there -> j, D - u); the integrals of 1, exp(-s u) and
    exp(-s u) exp(-s (D - u)) are D, (1 - e) / s and D e.

    Source: Hobolth, Jensen: Summary statistics for endpoint-conditioned continuous-time Markov
    chains (2011), for two states.
    """
    total = leave + come
    p, q = come / total, leave / total
    decay = np.exp(-total * steps)
    once, both = (1 - decay) / total, steps * decay
    there, elsewhere = presence, 1 - presence  # at the look before
    # Weights of the four pairs of states, each times what the look says of the second.
    start = (there, elsewhere)
    end = (if_present, if_absent)
    goes = ((p + q * decay, q - q * decay), (p - p * decay, q + p * decay))
    weight = [[start[i] * goes[i][j] * end[j] for j in (0, 1)] for i in (0, 1)]
    evidence = weight[0][0] + weight[0][1] + weight[1][0] + weight[1][1]
    # P(i -> there, u) = p + a_i exp(-s u); P(there -> j, v) = b_j + c_j exp(-s v);
    # P(not there -> j, v) = b_j + d_j exp(-s v); likewise P(i -> not there, u) = q - a_i exp(-s u).
    a, b, c, d = (q, -p), (p, q), (q, -q), (-p, p)
    present = departures = arrivals = np.zeros(np.shape(evidence))
    for i in (0, 1):
        for j in (0, 1):
            chance = start[i] * end[j]
            stayed = p * b[j] * steps + (p * c[j] + a[i] * b[j]) * once + a[i] * c[j] * both
            left = p * b[j] * steps + (p * d[j] + a[i] * b[j]) * once + a[i] * d[j] * both
            came = q * b[j] * steps + (q * c[j] - a[i] * b[j]) * once - a[i] * c[j] * both
            present = present + chance * stayed
            departures = departures + chance * leave * left
            arrivals = arrivals + chance * come * came
    return Interval(
        presence=(weight[0][0] + weight[1][0]) / evidence,
        evidence=evidence,
        departures=departures / evidence,
        arrivals=arrivals / evidence,
        time_present=present / evidence,
    )
