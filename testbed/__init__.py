"""Plants, loggers and scoring that judge a diagnosis from outside: nothing here is made by the package that is judged.

Only `runner` calls `irb140_jax`, through what it offers to everybody; a layer test says so.
"""
