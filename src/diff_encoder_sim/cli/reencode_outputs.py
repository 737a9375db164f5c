"""The files that reencode writes."""

from __future__ import annotations

from pathlib import Path
from typing import Dict, Optional, Sequence

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.cli.reencode_arguments import CSV_NAME
from diff_encoder_sim.wheels.catalogue import ChosenEncoder
from diff_encoder_sim.wheels.encoder_params import file_label


def output_files(folder: Optional[Path], bag: Path, encoders: Sequence[ChosenEncoder]) -> Dict[str, Path]:
    """Return the path of each encoder's bag, by its label, and that of the CSV file; none without a folder.

    Raises:
        ConfigError: one of the files exists.
    """
    if folder is None:
        return {}
    stem = bag.resolve().stem  # also where the bag is given as `.`
    files = {each.label: folder / f'{stem}_{file_label(each.ppr, each.name)}.bag' for each in encoders}
    files[CSV_NAME] = folder / CSV_NAME
    for path in files.values():
        if path.exists():
            raise ConfigError(f'--out: {path} exists; allowed: a folder without it')
    return files
