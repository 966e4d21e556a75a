"""One flight: flown, logged, scored and summed up."""
