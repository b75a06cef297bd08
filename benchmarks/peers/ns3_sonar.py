"""What ns-3 makes of sound and noise, kept as a reference for the tests.

pip install 'bindusbl-des[peers]'
python benchmarks/peers/ns3_sonar.py > tests/reference/ns3_sonar.csv
"""

import subprocess
import tempfile
from pathlib import Path

from ns3_uan import compiled_driver


def main() -> None:
    """Compile the program against the installed ns-3, and let it print (raises PeerMissing)."""
    with tempfile.TemporaryDirectory() as folder:
        program = compiled_driver(Path(folder), Path(__file__).with_suffix(".cc"))
        subprocess.run([str(program)], check=True)


if __name__ == "__main__":
    main()
