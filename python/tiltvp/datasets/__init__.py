"""Images with known tilt."""
