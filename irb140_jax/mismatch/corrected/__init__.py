"""The corrected model: what predicts, as a JAX pytree and as MJCF."""
