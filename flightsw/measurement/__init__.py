"""From channels to measurements: observables, their model and their noise."""
