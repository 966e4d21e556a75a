"""The modified real-time iteration (Algorithm MRTI)."""
