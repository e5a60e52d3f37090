"""Where answers go: recordings for ROS 2, trajectories of TUM's format, static transforms."""
