"""Feed a recorded flight to the controller and compare its commands with the recorded ones."""

import sys

from relform_analysis.replay.command import main
from relform_core.script import run_script

if __name__ == "__main__":
    sys.exit(run_script(main))
