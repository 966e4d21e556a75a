"""Many flights: planned, flown in parallel, kept and compared."""
