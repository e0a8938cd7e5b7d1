"""Files of strangers that are read whole."""
