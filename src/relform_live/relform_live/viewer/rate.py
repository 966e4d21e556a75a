"""How often the page is updated."""

FRAME_S = 1.0 / 15.0
"""Wall time from one frame to the next."""
