"""The nodes: recorder, player, and the check of a playback."""
