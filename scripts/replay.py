"""Feed a recorded flight to the controller and compare its commands with the recorded ones."""

import sys

from relform_tools.replay_command import main

if __name__ == "__main__":
    sys.exit(main())
