"""A job done by many processes, on this machine or others."""
