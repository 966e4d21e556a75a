"""Shows a flight in a browser, while it is flown or from its bag."""
