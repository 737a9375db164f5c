"""Where the checkout is, for tests at any depth."""

from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
CONFIG, WORLDS, SOURCE = ROOT / 'config', ROOT / 'worlds', ROOT / 'src'
SUPPORT = ROOT / 'test' / 'support'
REAL_DRIVES = ROOT.parent / 'shared' / 'data' / 'real_drives'  # of others; not part of the project
