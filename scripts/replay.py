"""Feed a recorded flight to the controller and compare its commands with the recorded ones."""

import sys

from relform_tools.replay_command import main
from relform_tools.script import run_script

if __name__ == "__main__":
    sys.exit(run_script(main))
