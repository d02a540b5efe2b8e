"""Model selection: the evidence of sets of effects, moves between sets, and averages over them."""
