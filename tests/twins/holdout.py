"""Holdouts and bad pixels, before and after a method."""

import numpy as np


def before(color, holdout):
    """Colour times weight, and weight: 0 for bad pixels and for what is kept."""
    good = np.isfinite(color).all(axis=2)
    amount = np.where(np.isfinite(holdout), np.clip(np.nan_to_num(holdout), 0, 1), 0)
    weight = np.where(good, 1 - amount, 0)
    return np.where(good[..., None], color, 0) * weight[..., None], weight


def after(color, holdout, blurred):
    """The result with what is kept put back."""
    good = np.isfinite(color).all(axis=2)
    amount = np.where(good & np.isfinite(holdout), np.clip(np.nan_to_num(holdout), 0, 1), 0)[
        ..., None
    ]
    return np.where(
        amount > 0, blurred * (1 - amount) + np.where(good[..., None], color, 0) * amount, blurred
    )
