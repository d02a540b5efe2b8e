"""`python -m irb140_jax`, the same as `irb140`."""

import sys

from irb140_jax.cli import main

sys.exit(main())
