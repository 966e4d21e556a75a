"""The optimal control problem: model, terms of the cost, and bounds."""
