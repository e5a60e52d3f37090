"""How well the methods do: metrics, runs over data with known tilt, tables."""
