"""The ROS side of relform: message conversions, QoS profiles, lock-step and the node runner."""
