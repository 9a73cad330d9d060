"""``python -m mpad_core`` is ``mpad``."""

from mpad_core.cli import main

main()
