"""A consumer of the tilt: pose estimation by min-warping, which takes the robot to move in a plane and be upright."""
