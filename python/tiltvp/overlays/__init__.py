"""What was found, drawn over its image with OpenCV: edges, the tilt, vertical lines, corners."""
