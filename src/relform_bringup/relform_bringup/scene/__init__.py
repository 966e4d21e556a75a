"""What tools of ROS draw of a flight, as plain values: poses, shapes, paths, and a model of each vehicle."""
