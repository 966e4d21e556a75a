"""Types, errors, units and configuration schema that every relform package shares; free of ROS."""
