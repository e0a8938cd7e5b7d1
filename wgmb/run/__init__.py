"""Runs: a request becomes a job, and a job becomes files."""
