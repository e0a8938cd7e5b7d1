"""From a frame to a blurred picture: one method between preparation and sum."""
