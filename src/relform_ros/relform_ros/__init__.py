"""The ROS side of relform: message conversions, topics, pacing, parameters and the main function of nodes."""
