"""The laboratory: comparing methods with a ground truth, timing them, experiments."""
