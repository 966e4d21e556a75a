"""What a view of a flight shows, without ROS and without a browser."""
