"""The fault campaign: flights on the wall clock to which something happens, and what must hold then."""
