"""Orientation and calibration from the straight lines of man-made places."""
