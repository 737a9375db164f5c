"""Files of trials by content, for workers without access to the client's folders."""

from __future__ import annotations

import hashlib
import re
from pathlib import Path
from typing import Any, Dict, NamedTuple, Sequence, Tuple, Union
from xml.etree import ElementTree

import yaml

from diff_encoder_sim.base.atomic_files import write_file
from diff_encoder_sim.base.command_line import as_typed
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.yaml_files import load_yaml
from diff_encoder_sim.drives.test_definition import TestDefinition, find_world
from diff_encoder_sim.localization.map_files import load_map
from diff_encoder_sim.robots.description import Findings, RobotSource
from diff_encoder_sim.robots.meshes import MeshFinder, primitive_tree
from diff_encoder_sim.robots.urdf_reading import parse_urdf, read_robot_text
from diff_encoder_sim.robots.xacro_expansion import expansion, find_mesh
from diff_encoder_sim.simulation.world import load_world

NAME_DIGITS = 16  # of a sha256 in the name of a folder


class TrialFiles(NamedTuple):
    """Worlds, maps and the robot: contents, small when pickled, or paths of this host."""

    contents: Dict[str, bytes]  # by path below the folder, which names them by hash; empty when they are in a folder
    robot: Path  # absolute, or below the folder
    worlds: Dict[str, Dict[str, Any]]  # by the name of the test: paths of its `world` and `map`, '' for no map

    def sha256(self) -> Dict[str, str]:
        """Return the sha256 of each file's content, by path below the folder."""
        return {name: _sha256(content) for name, content in sorted(self.contents.items())}

    def materialise(self, folder: Union[str, Path]) -> TrialFiles:
        """Write the files below `folder` unless they exist; return their absolute paths; OSError if that fails."""
        for name, content in self.contents.items():
            path = Path(folder, name)
            if not path.is_file():
                path.parent.mkdir(parents=True, exist_ok=True)
                write_file(path, content)
        worlds = {
            test: {name: path and str(Path(folder, path)) for name, path in files.items()}
            for test, files in self.worlds.items()
        }
        return TrialFiles({}, Path(folder, self.robot), worlds)


def collect(
    tests: Sequence[TestDefinition], worlds_folder: Union[str, Path], source: RobotSource, needs_maps: bool
) -> TrialFiles:
    """Read and check the files of tests with unique names; ConfigError if one is bad, or trials need a missing map."""
    contents: Dict[str, bytes] = {}

    def add(files: Dict[str, bytes]) -> str:
        """Put related files into a folder named by their hash; return the path of the first."""
        digest = _sha256(b''.join(files.values()))[:NAME_DIGITS]
        contents.update((f'{digest}/{name}', content) for name, content in files.items())
        return f'{digest}/{next(iter(files))}'

    worlds = {}
    for test in tests:
        world = find_world(test.world, worlds_folder)
        load_world(world)
        worlds[test.name] = {'world': add({world.name: world.read_bytes()}), 'map': ''}
        map_path = world.with_suffix('.yaml')
        if map_path.is_file():
            load_map(map_path)
            description = load_yaml(map_path)
            # The image may be in any folder; copy it next to its YAML file.
            image = (map_path.parent / description['image']).read_bytes()
            description['image'] = f'{map_path.stem}.image'
            content = yaml.safe_dump(description, sort_keys=True).encode('utf-8')
            worlds[test.name]['map'] = add({map_path.name: content, description['image']: image})
        elif needs_maps and test.route:
            allowed = f'a map .yaml file next to its world, as made by {as_typed("rasterise_world")}'
            raise ConfigError(f'map: {map_path} not found; allowed: {allowed}')
    # A xacro without includes is kept, as wheel errors may be its arguments.
    if source.arguments or source.added_laser or needs_other_files(read_robot_text(source.file)):
        urdf, meshes = self_contained_urdf(expansion(source).urdf, str(source.file), lambda uri: find_mesh(uri, source))
        robot = {f'{source.file.name.partition(".")[0]}.urdf': urdf.encode('utf-8'), **meshes}
    else:
        robot = {source.file.name: source.file.read_bytes()}
    return TrialFiles(contents, Path(add(robot)), worlds)


def needs_other_files(text: str) -> bool:
    """Return whether a xacro or URDF may mean something else, or nothing, on another machine."""
    return re.search(r'include|load_yaml|<mesh|\$\((?!arg\b)', text) is not None


def self_contained_urdf(urdf: str, where: str, find: MeshFinder) -> Tuple[str, Dict[str, bytes]]:
    """Return a URDF (xacro expanded) that needs only mesh files next to it, and their contents by path.

    These are collision meshes, and visual meshes of links whose visual shapes count. Other meshes keep their names.
    ConfigError as of `primitive_tree`; `where`, the robot's file, begins the text.
    """
    tree = parse_urdf(urdf, where)
    simple = primitive_tree(tree, find, Findings())
    files: Dict[str, bytes] = {}
    for link in tree.xml.findall('link'):
        kinds = ('collision', 'visual') if simple.links[link.get('name', '')].visuals else ('collision',)
        for mesh in (mesh for kind in kinds for mesh in link.iterfind(f'{kind}/geometry/mesh')):
            try:
                path = find(mesh.get('filename', '').strip())
            except ConfigError:  # of an accessory, or visual: it is left out here, too
                continue
            if path is not None and path.is_file():
                content = path.read_bytes()
                name = f'{_sha256(content)[:8]}/{path.name}'
                files[name] = content
                mesh.set('filename', name)
    return (ElementTree.tostring(tree.xml, encoding='unicode') if files else urdf), files


def _sha256(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()
