"""The optimal control problem: model, cost and constraints of the team."""
