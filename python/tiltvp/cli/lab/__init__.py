"""The verbs of the laboratory: `dataset`, `evaluate`, `measure` and `report`."""
