"""Many diagnoses: of a folder of units side by side and resumable, and what differs between diagnoses."""

from irb140_jax.fleet.layout import Unit as Unit
from irb140_jax.fleet.layout import shard_of as shard_of
from irb140_jax.fleet.layout import units_in as units_in
from irb140_jax.fleet.run import diagnose_units as diagnose_units
from irb140_jax.fleet.store import results_store as results_store
from irb140_jax.fleet.table import write_table_and_page as write_table_and_page
