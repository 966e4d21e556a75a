"""The paper's evaluation, flown again: its figures, its claims, and what each part of its method is worth."""
