"""Interactive reports: one HTML file each that opens offline, of a flight or of a sweep."""
