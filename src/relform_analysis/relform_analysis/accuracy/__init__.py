"""How accurate the team estimator is beside raw feedback, case by case, and its targets."""
