"""Perception by a cone cell, by time itself: every instant of the past, weighted."""

import numpy as np


def response(ages, rate, peak):
    """The answer to a flash `ages` seconds ago."""
    x = rate * (peak - ages)
    return rate * np.exp(x - np.exp(np.minimum(x, 60)))


def perceived(pictures, shown, after, rate=50.0, peak=0.05, step=2e-5):
    """`shown` a second; seen `after` [s] the middle of the last one; the first was always there."""
    ages = np.arange(-0.05, 1.0, step) + step / 2
    index = len(pictures) - 1 + np.floor((after - ages) * shown + 0.5).astype(int)
    index = np.clip(index, 0, len(pictures) - 1)
    weights = np.bincount(index, response(ages, rate, peak) * step, len(pictures))
    return np.tensordot(weights, np.asarray(pictures, float), 1)
