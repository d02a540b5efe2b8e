"""The regression: nuisance parameters, model discrepancy, sensor noise, and the Gram matrices of every joint."""
