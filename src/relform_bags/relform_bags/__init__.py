"""Bags of ROS 2: written, read, recovered and played."""
