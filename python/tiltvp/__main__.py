"""`python -m tiltvp`, the same as `tiltvp`."""

import sys

from tiltvp.cli import main

sys.exit(main())
