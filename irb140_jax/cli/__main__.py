"""`python -m irb140_jax.cli`, the same as `irb140`."""

import sys

from irb140_jax.cli.run import main

sys.exit(main())
