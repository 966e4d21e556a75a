"""The terms of the cost, one module each; ``registry.py`` lists them."""
