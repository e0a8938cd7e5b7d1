"""A State becomes images on the screen."""
