"""Videos as pictures with times."""
