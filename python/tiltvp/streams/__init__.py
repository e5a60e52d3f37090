"""Where frames, odometry and inertial data come from, with their times, and where answers go."""
