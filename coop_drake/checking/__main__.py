"""``python -m coop_drake.checking QUESTION ANSWER``."""

import sys

from coop_drake.checking.check import main

sys.exit(main(sys.argv[1:]))
