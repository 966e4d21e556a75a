"""What the team is asked to follow: path of the leader, shape of the formation."""
