"""The files that trials read, by content: for workers that do not see the client's folders."""

from __future__ import annotations

import hashlib
import os
import shutil
import tempfile
import zlib
from pathlib import Path
from typing import Dict, NamedTuple, Sequence, Union

import yaml

from diff_encoder_sim.base.command_line import as_typed
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.yaml_files import load_yaml
from diff_encoder_sim.drives.test_definition import TestDefinition, find_world
from diff_encoder_sim.localization.map_files import load_map
from diff_encoder_sim.robots.description import RobotSource
from diff_encoder_sim.robots.package_search import find_mesh
from diff_encoder_sim.robots.simulated_robot import needs_other_files, self_contained_urdf
from diff_encoder_sim.robots.urdf_reading import read_robot_text
from diff_encoder_sim.robots.xacro_expansion import expand
from diff_encoder_sim.simulation.world import load_world

NAME_DIGITS = 16  # of a sha256, where it names a folder


class WorldFiles(NamedTuple):
    """World and map of a test: paths, absolute or below the folder; '' for no map."""

    world: str
    map: str


class PlacedFiles(NamedTuple):
    """Paths of the files on this host."""

    robot: Path
    worlds: Dict[str, WorldFiles]  # by the name of the test


class TrialFiles(NamedTuple):
    """Worlds, maps and the robot; small when pickled."""

    contents: Dict[str, bytes]  # compressed by zlib, by path below the folder
    robot: str  # its path below the folder
    worlds: Dict[str, WorldFiles]  # by the name of the test

    def sha256(self) -> Dict[str, str]:
        """Return the sha256 of each file's content, by path below the folder."""
        return {name: _sha256(zlib.decompress(content)) for name, content in sorted(self.contents.items())}

    def materialise(self, folder: Union[str, Path]) -> PlacedFiles:
        """Write the files below `folder`, unless they are there.

        Several processes may do so at once: the files appear together, whole.

        Raises:
            OSError: the folder cannot be written to.
        """
        digest = _sha256(repr(self.sha256()).encode('utf-8'))
        placed = Path(folder) / digest[:NAME_DIGITS]
        if not placed.is_dir():
            self._write(placed)
        return PlacedFiles(
            placed / self.robot,
            {test: WorldFiles(*(name and str(placed / name) for name in files)) for test, files in self.worlds.items()},
        )

    def _write(self, placed: Path) -> None:
        placed.parent.mkdir(parents=True, exist_ok=True)
        unfinished = Path(tempfile.mkdtemp(prefix=f'.{placed.name}.', dir=placed.parent))
        try:
            for name, content in self.contents.items():
                path = unfinished / name
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_bytes(zlib.decompress(content))
            os.rename(unfinished, placed)
        except OSError:
            shutil.rmtree(unfinished, ignore_errors=True)
            if not placed.is_dir():  # another process was first
                raise


def collect(
    tests: Sequence[TestDefinition], worlds_folder: Union[str, Path], source: RobotSource, needs_maps: bool
) -> TrialFiles:
    """Read what the tests need, and check that it can be used.

    Args:
        tests: with names that differ.
        worlds_folder: where worlds are found by name; each has its map beside it.
        source: the robot.
        needs_maps: whether a world without a map is an error.

    Raises:
        ConfigError: a file is missing or bad.
    """
    contents: Dict[str, bytes] = {}
    worlds = {}
    for test in tests:
        world = find_world(test.world, worlds_folder)
        load_world(world)
        worlds[test.name] = WorldFiles(
            _add(contents, {world.name: world.read_bytes()})[0],
            _add_map(contents, world.with_suffix('.yaml'), needs_maps),
        )
    robot = _add(contents, _robot_file(source))[0]
    return TrialFiles(contents, robot, worlds)


def _add_map(contents: Dict[str, bytes], path: Path, is_needed: bool) -> str:
    if not path.is_file():
        if is_needed:
            raise ConfigError(
                f'map: {path} not found; allowed: a map .yaml file beside its '
                f'world, as made by {as_typed("rasterise_world")}'
            )
        return ''
    load_map(path)
    description = load_yaml(path)
    # The image may lie anywhere; there it lies beside its YAML file.
    image = (path.parent / description['image']).read_bytes()
    description['image'] = f'{path.stem}.image'
    text = yaml.safe_dump(description, sort_keys=True)
    return _add(contents, {path.name: text.encode('utf-8'), description['image']: image})[0]


def _robot_file(source: RobotSource) -> Dict[str, bytes]:
    """Return the robot by the name of its file, so that it needs no other file.

    A xacro that needs none stays as it is, as wheel errors may be its arguments.
    """
    text = read_robot_text(source.file)
    if not (source.arguments or source.added_laser or needs_other_files(text)):
        return {source.file.name: source.file.read_bytes()}
    urdf = self_contained_urdf(expand(source), str(source.file), lambda uri: find_mesh(uri, source))
    return {f'{source.file.name.partition(".")[0]}.urdf': urdf.encode('utf-8')}


def _add(contents: Dict[str, bytes], files: Dict[str, bytes]) -> Sequence[str]:
    """Put files that belong together into a folder named by what is in them."""
    digest = _sha256(b''.join(files.values()))[:NAME_DIGITS]
    names = [f'{digest}/{name}' for name in files]
    for name, content in zip(names, files.values()):
        contents[name] = zlib.compress(content, 9)
    return names


def _sha256(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()
