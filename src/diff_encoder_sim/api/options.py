"""Options of commands and of the API, each declared once: its default, and its argument of the command line."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any, Mapping, Optional, Sequence, Union

from diff_encoder_sim.analysis.quantities import LEVEL, REQUIRED_FRACTION, YAW, X
from diff_encoder_sim.base.bounds import COUNTER_STATES, LENGTH, PLACES, PULSES_PER_TURN, SEEDS, TRIALS, Between
from diff_encoder_sim.drives.number_units import ANGLE_UNITS, LENGTH_UNITS, TIME_UNITS, UNITS
from diff_encoder_sim.drives.topics import BAG_FORMATS, ODOM, SCAN
from diff_encoder_sim.drives.topics import IMU as IMU_DATA
from diff_encoder_sim.robots.wheel_quality import QUALITIES

ROBOT = 'robot: a name (config/robots/), a robot file (.yaml), or a xacro or URDF file'
IMU = 'IMU to simulate: mpu6050, bno055, ... (files of config/imu/), or a .yaml file'
ENCODERS = 'real encoders: amt102, pololu_25d, ... (files of config/encoders/; catalogue: all), or .yaml files'
TESTS = 'tests: SL, SMT, DLD, UMBMARK, or .yaml files'
OVERRIDES = 'overrides of the campaign file (--ppr or --encoders: of both)'
WHEELS, NO_ANGLES = 'wheels, if the bag has several', 'wheels of a drive without wheel angles'
DRAWS, DELAYS = Between(0, 10_000), Between(-10.0, 10.0, 's')
FUSED = 'fusion of odometry with an IMU'
REFERENCE = 'reference: poses that do not depend on the wheels'
SQUARES = 'UMBmark'
TWO_NUMBERS = 'two numbers in place of a robot (by default 10 m straight; no URDF, laser, simulation or trials)'


def option(
    default: Any,
    text: str,
    metavar: Any = None,
    bounds: Optional[Between] = None,
    group: str = '',
    flag: str = '',
    **argument: Any,
) -> Any:
    """Return a field with its argument of the command line, of the type and number that the annotation contains.

    A switch has no `metavar`. `flag` may be a positional name; by default it is -- and the name of the field. `group`
    is a title in the help; `argument` is for `ArgumentParser.add_argument`.
    """
    if default not in (None, '', ()) and not isinstance(default, bool):
        values = default if isinstance(default, tuple) else (default,)
        text += f' (default: {" ".join(f"{each:g}" if isinstance(each, float) else str(each) for each in values)})'
    argument.update({'help': text, 'metavar': metavar})
    return field(default=default, metadata={'group': group, 'flag': flag, 'bounds': bounds, 'argument': argument})


@dataclass(frozen=True)
class RobotOptions:
    """Xacro arguments of a robot, and folders of its packages."""

    robot_args: Sequence[str] = option((), 'xacro argument', 'NAME:=VALUE', flag='--robot-arg', action='append')
    packages: Sequence[Path] = option((), "folders with packages of the robot's package:// and $(find)", 'DIR')


@dataclass(frozen=True)
class InspectOptions(RobotOptions):
    """Options of the command check_robot."""

    robot: str = option('', ROBOT, 'ROBOT', flag='robot')
    write: Optional[Path] = option(None, 'write a robot file with the detected values, for --robot and robot:=', 'FILE')


@dataclass(frozen=True)
class RunOptions(RobotOptions):
    """Options of commands that run trials: robot, AMCL, and workers on this host or a Dask cluster."""

    amcl: Optional[str] = option(None, "AMCL's parameters: amcl, amcl_accurate, or a .yaml file", 'NAME|FILE')
    unchecked: bool = option(False, 'run even if the robot self-check fails, or the robot does not fit a test')
    workers: Optional[int] = option(None, 'worker processes (default: one for each core)', 'N', Between(1, 1024))
    scheduler: Optional[str] = option(None, 'of a Dask cluster, as tcp://host:8786 (docs/campaigns.md)', 'ADDRESS')


@dataclass(frozen=True)
class CampaignOptions(RunOptions):
    """Options of the command campaign."""

    config: str = option(
        '', 'quick, paper, accurate, ... (files of config/campaigns/), or a .yaml file', 'NAME|FILE', required=True
    )
    out: Path = option(None, 'results folder: new, or with results to complete', 'DIR', required=True)
    resume: bool = option(False, 'fail if DIR has no results yet')
    tests: Optional[Sequence[str]] = option(None, TESTS, 'TEST', group=OVERRIDES)
    ppr: Optional[Sequence[float]] = option(
        None, 'ideal encoders, counts per wheel turn', 'N', PULSES_PER_TURN, OVERRIDES
    )
    encoders: Optional[Sequence[str]] = option(None, ENCODERS, 'NAME|FILE', group=OVERRIDES)
    trials: Optional[int] = option(None, 'trials of each test with each encoder', 'N', TRIALS, OVERRIDES)
    nav: Optional[str] = option(None, 'with feedback or without', group=OVERRIDES, choices=('embedded', 'scripted'))
    robot: Optional[str] = option(None, ROBOT, 'NAME|FILE', group=OVERRIDES)
    imu: Optional[str] = option(None, IMU, 'NAME|FILE', group=OVERRIDES)
    fusion: Optional[str] = option(None, 'of odometry with the IMU', group=OVERRIDES, choices=('none', 'embedded'))
    record: Optional[str] = option(
        None, 'all topics; without scans and bulk; or no bags', group=OVERRIDES, choices=('full', 'minimal', 'none')
    )
    bag_format: Optional[str] = option(None, 'ROS 1 (default) or MCAP of ROS 2', group=OVERRIDES, choices=BAG_FORMATS)
    others: Mapping[str, Any] = field(default_factory=dict)  # other keys of the campaign file

    @property
    def keys(self) -> Mapping[str, Any]:
        """Return the keys that override those of the campaign file, unless None."""
        given = [each.name for each in fields(self) if each.metadata.get('group') == OVERRIDES]
        return {**{name: getattr(self, name) for name in given}, **self.others}


@dataclass(frozen=True)
class WheelOptions(RobotOptions):
    """Options of commands that read recorded drives: robot and wheels."""

    config: Optional[Path] = option(None, 'wheels, joints and counter (default: config/config.yaml)', 'FILE')
    robot: Optional[str] = option(None, f"{ROBOT} (default: the bag's trial, else config/config.yaml)", 'NAME|FILE')
    joint_states: str = option('', "topic of wheel angles (default: the bag's only one)", 'TOPIC', group=WHEELS)
    left: str = option('', "left joint (default: the robot's, or the bag's only left wheel)", 'JOINT', group=WHEELS)
    right: str = option('', "right joint (default: the robot's, or the bag's only right wheel)", 'JOINT', group=WHEELS)
    pulses: str = option('', 'topic of counts, used instead of wheel angles', 'TOPIC', group=WHEELS)
    pulses_ppr: str = option(
        '', 'counts per wheel turn of their encoder (default: that of the recorded trial)', 'PPR', group=WHEELS
    )
    ticks: Sequence[str] = option(
        (), 'numbers in messages: TOPIC, TOPIC[0], or TOPIC.field.field[0]', ('LEFT', 'RIGHT'), group=NO_ANGLES, nargs=2
    )
    columns: Sequence[str] = option(
        (), 'columns of the table: names or numbers from 1', ('TIME', 'LEFT', 'RIGHT'), group=NO_ANGLES, nargs=3
    )
    time_unit: str = option('', 'unit of the time columns (default: s)', group=NO_ANGLES, choices=TIME_UNITS)
    unit: str = option(
        '',
        'unit of --ticks or of the table; ticks/message: since the last one (default: ticks)',
        group=NO_ANGLES,
        choices=UNITS,
    )
    ticks_per_revolution: Any = option(
        '', 'ticks per wheel revolution, or "{left: N, right: N}" (default: the --robot\'s ppr)', 'N', group=NO_ANGLES
    )
    ticks_modulus: Optional[int] = option(
        None, 'where the counter wraps, 0: never (default: by the type of its field)', 'N', COUNTER_STATES, NO_ANGLES
    )
    reversed: Sequence[str] = option(
        (), 'wheels whose numbers fall when the robot drives forward', group=NO_ANGLES, choices=('left', 'right')
    )
    odom: str = option(
        '', 'last resort: wheel angles from poses: a topic, or "odom->base_link"', 'TOPIC|FRAMES', group=NO_ANGLES
    )


@dataclass(frozen=True)
class SourceOptions(WheelOptions):
    """Options of commands that read recorded drives with a reference."""

    reference: str = option(
        '', 'topic, "map->base_link", or (calibrate) scan (default: /world_pose)', 'TOPIC|FRAMES', group=REFERENCE
    )
    reference_columns: Sequence[str] = option(
        (), 'TIME X Y [YAW] in the table or in --reference-csv; in --time-unit', 'COLUMN', group=REFERENCE
    )
    reference_csv: Sequence[Path] = option((), 'tables of poses, one for each drive', 'FILE', group=REFERENCE)
    reference_covariance: Sequence[str] = option(
        (), 'columns of the covariance: XX XY XYAW YY YYAW YAWYAW; without YAW: XX XY YY', 'COLUMN', group=REFERENCE
    )
    length_unit: str = option('', 'unit of X and Y (default: m)', group=REFERENCE, choices=LENGTH_UNITS)
    angle_unit: str = option('', 'unit of YAW (default: rad)', group=REFERENCE, choices=ANGLE_UNITS)


@dataclass(frozen=True)
class AdviceOptions(WheelOptions, RunOptions):
    """Options of the command advise."""

    robot: Optional[str] = option(None, f"{ROBOT} (default: alto; with --drive, that of the bag's trial)", 'NAME|FILE')
    drive: Optional[Path] = option(None, 'recorded drive in place of the tests, without trials', 'BAG|TABLE')
    wheel_diameter: Optional[float] = option(None, 'of the drive wheels, in metres', 'M', LENGTH, TWO_NUMBERS)
    wheel_separation: Optional[float] = option(None, 'of their contact points, in metres', 'M', LENGTH, TWO_NUMBERS)
    turns: float = option(1.0, 'turns in place, next to the straight --distance', 'N', Between(0, 1000), TWO_NUMBERS)
    wheels: str = option(
        '', 'accuracy of radii and separation (default: of the robot file, else exact)', choices=tuple(QUALITIES)
    )
    tolerance: float = option(X.tolerance, 'allowed in x and y at the goal, in metres', 'M', Between(1e-6, 1000.0, 'm'))
    yaw_tolerance: float = option(
        YAW.tolerance, 'allowed heading error, in degrees', 'DEG', Between(1e-6, 360.0, 'degrees')
    )
    share: float = option(REQUIRED_FRACTION, 'of trials within tolerance, at least', 'FRACTION', Between(0.01, 0.999))
    confidence: float = option(LEVEL, 'of the answers', 'FRACTION', Between(0.5, 0.9999))
    distance: Optional[float] = option(None, 'straight drive in place of the tests', 'M', Between(0.1, 1000.0, 'm'))
    tests: Optional[Sequence[str]] = option(None, TESTS, 'TEST')
    ppr: Optional[Sequence[float]] = option(None, 'ideal encoders, counts per wheel turn', 'N', PULSES_PER_TURN)
    encoders: Optional[Sequence[str]] = option(None, ENCODERS, 'NAME|FILE')
    imu: Sequence[str] = option((), 'fused with the wheels: bno055, ... (config/imu/), or .yaml files', 'NAME|FILE')
    candidates: str = option('sweep', 'campaign file with the default tests and candidates', 'NAME|FILE')
    trials: Optional[int] = option(
        None, 'per test and tested candidate (default: as many as allow two failures, 39 for 80 %%)', 'N', TRIALS
    )
    has_trials: bool = option(True, 'answer only for odometry', flag='--no-trials', action='store_false')
    out: Path = option(Path('results/advice'), 'results folder: new, or with results of the same advice', 'DIR')
    json: Optional[Path] = option(
        None, 'write all results as JSON (docs/file_formats.md) here too (default: only advice.json in DIR)', 'FILE'
    )


@dataclass(frozen=True)
class DriveOptions(SourceOptions):
    """Options of the command reencode; only the bag or the table is required."""

    bag: Optional[Path] = option(None, 'bag of ROS 1 (complete or truncated) or ROS 2', 'BAG', flag='bag', nargs='?')
    ppr: Union[float, Sequence[Any]] = option(
        (), 'ideal encoders: 90, or "{left: 90, right: 1024}" (default: --robot\'s, else 40 90 1024 4096)', 'PPR'
    )
    encoder: Sequence[str] = option((), ENCODERS, 'NAME|FILE')
    out: Optional[Path] = option(None, 'write a bag for each encoder, reencode.csv and drive.html into DIR', 'DIR')
    page: Optional[Path] = option(None, 'write only the page: paths, errors, spread, and their causes', 'FILE')
    csv: Optional[Path] = option(None, 'table in place of a bag; its delimiter is detected', 'FILE', group=NO_ANGLES)
    draws: Optional[int] = option(
        None, 'sampled start angles of the wheels; 0: as recorded (default: 200, or 0 if they are recorded)', 'N', DRAWS
    )
    seed: Optional[int] = option(None, "for draws and encoder errors (default: the trial's number, else 0)", 'N', SEEDS)
    json: Optional[Path] = option(None, 'write median and 5 to 95 %% as JSON (docs/file_formats.md)', 'FILE')
    reference_pose: Sequence[float] = option(
        (), 'of its sensor on the robot, in m, rad (default: --robot)', ('X', 'Y', 'YAW'), PLACES, REFERENCE, nargs=3
    )
    reference_delay: Optional[float] = option(
        None, 'age of its poses at their stamps, in s (default: that of the robot file, else 0)', 'S', DELAYS, REFERENCE
    )

    fusion: str = option(
        'none', 'also fuse with an IMU of the bag (with --imu)', group=FUSED, choices=('none', 'embedded')
    )
    imu: str = option('', 'the IMU: mpu6050, ... (files of config/imu/), or a .yaml file', 'NAME|FILE', group=FUSED)
    imu_topic: str = option(IMU_DATA, 'topic of its samples (sensor_msgs/Imu)', 'TOPIC', group=FUSED)


@dataclass(frozen=True)
class CalibrateOptions(SourceOptions):
    """Options of the command calibrate; drives or, with `--umbmark`, `--ends` are required."""

    drives: Sequence[Path] = option((), 'bags of ROS 1 or ROS 2', 'DRIVE', flag='drives', nargs='*')
    out: Optional[Path] = option(
        None, 'write (or replace) the calibrated robot file, calibration.html and ROS parameters next to it', 'FILE'
    )
    json: Optional[Path] = option(None, 'write all results as JSON (docs/file_formats.md)', 'FILE')
    csv: Sequence[Path] = option((), 'tables in place of bags; their delimiter is detected', 'FILE', group=NO_ANGLES)
    slip_by_motion: bool = option(False, 'estimate slip by longitudinal and lateral acceleration, too')
    umbmark: bool = option(False, 'report E_b, E_d and E_max,syst of squares in both directions', group=SQUARES)
    ends: Optional[Path] = option(None, 'table in place of drives: cw or ccw, x, y [m]', 'FILE', group=SQUARES)
    side: float = option(4.0, 'side of the squares of --ends, in metres', 'M', LENGTH, SQUARES)


@dataclass(frozen=True)
class ConformanceOptions(WheelOptions):
    """Options of the command conformance."""

    bag: Path = option(None, 'bag of ROS 1 or ROS 2', 'BAG', flag='bag')
    odom: str = option(ODOM, 'topic of the odometry to judge', 'TOPIC')
    wheel_diameter: Optional[float] = option(None, 'as the node assumes it, in metres (default: --robot)', 'M', LENGTH)
    wheel_separation: Optional[float] = option(None, 'likewise, in metres (default: --robot)', 'M', LENGTH)
    odom_frame: str = option('', 'expected frame (default: that of the first message)', 'FRAME')
    base_frame: str = option('', 'expected child frame (likewise)', 'FRAME')
    out: Optional[Path] = option(None, 'write conformance.html and conformance.xml (JUnit) into DIR', 'DIR')


@dataclass(frozen=True)
class AnalysisOptions:
    """Options of the command analyze."""

    paths: Sequence[Path] = option(
        (),
        "one campaign's results folder; or bags of trials or of other drives, and folders with such bags",
        'DIR|BAG',
        flag='paths',
    )
    beside: Optional[Path] = option(None, "another campaign's results folder, to compare with the paper too", 'DIR')
    out: Optional[Path] = option(
        None, 'new, empty, or an earlier analysis (default: analysis/ in the folder, or next to the first bag)', 'DIR'
    )


@dataclass(frozen=True)
class MapOptions:
    """Options of the command map_bag."""

    bag: Path = option(None, 'bag (ROS 1 or 2) with scans, odometry and /tf_static', 'BAG', flag='bag')
    stem: Optional[Path] = option(None, 'write STEM.pgm and STEM.yaml (default: next to the bag)', 'STEM', flag='-f')
    config: Optional[Path] = option(None, "parameters, by slam_gmapping's names (default: config/slam.yaml)", 'FILE')
    scan: str = option(SCAN, 'topic of scans', 'TOPIC')
    odom: str = option(ODOM, 'topic of odometry', 'TOPIC')
    seed: int = option(0, "seed of the particles; a trial's bag uses the trial's number", 'N', SEEDS)


@dataclass(frozen=True)
class RasterOptions:
    """Options of the command rasterise_world."""

    world: Path = option(None, '.world file (SDF, of primitives)', 'WORLD', flag='world')
    free: Sequence[float] = option(
        (0.0, 0.0), 'a point in m, from which all free space is reachable', ('X', 'Y'), PLACES, nargs=2
    )
    height: float = option(1.12, 'height of the scan plane above the floor, in metres', 'M', PLACES)
    resolution: float = option(0.05, 'side of a cell, in metres', 'M', Between(1e-3, 10.0, 'm'))
    out: Optional[Path] = option(None, 'write STEM.pgm and STEM.yaml (default: next to the world)', 'STEM')


@dataclass(frozen=True)
class DescriptionOptions:
    """Options of the command robot_description."""

    robot: str = option('', ROBOT, 'ROBOT', flag='robot')
    arguments: Sequence[str] = option((), "arguments of the robot's xacro", 'NAME:=VALUE', flag='arguments', nargs='*')
    robot_args: str = option('', 'further xacro arguments, as one string', 'TEXT')
    frames: bool = option(False, 'for robot_state_publisher: only wheels turn, the root link has no inertia')
    no_root_inertia: bool = option(False, 'root_inertia:=false, if the xacro has this argument')


def _file(stem: str) -> Any:
    return option(None, f'in place of config/{stem}.yaml', 'FILE')


@dataclass(frozen=True)
class LaunchOptions:
    """Launch arguments of a robot, as text."""

    robot: str = option('', ROBOT, 'ROBOT', flag='robot')
    robot_args: str = option('', 'xacro arguments: name=value name=value', 'TEXT')
    encoder: str = option('', 'real encoder, in place of ppr', 'NAME|FILE')
    imu: str = option('', IMU, 'NAME|FILE')
    fusion: str = option('none', 'of odometry with the IMU: none, embedded or upstream', 'VALUE')
    config: Optional[str] = _file('config')
    simulator_config: Optional[str] = _file('simulator')
    amcl_config: Optional[str] = _file('amcl')
    navigation_config: Optional[str] = _file('navigation')
    slam_config: Optional[str] = _file('slam')
    fusion_config: Optional[str] = _file('fusion')
    sim: str = option('', 'pybullet, if it simulates the wheels', 'NAME')


@dataclass(frozen=True)
class SettingsOptions(LaunchOptions):
    """Options of the command robot_settings."""

    values: Sequence[str] = option((), "overrides of the robot's", 'FILE.KEY:=VALUE', flag='values', nargs='*')
    bag: str = option('', "recorded drive, whose trial's number is the seed", 'BAG')


@dataclass(frozen=True)
class TrialOptions(LaunchOptions):
    """Arguments of trial.launch as text; `plan` validates them."""

    test: str = option('', 'SL, SMT, DLD, UMBMARK, or a .yaml file', 'TEST', required=True)
    ppr: str = option('', "counts per wheel turn: 90, or '{left: 90, right: 1024}' (default: the robot's own)", 'VALUE')
    trial: str = option('0', 'number of the trial, which is its seed', 'VALUE')
    odom: str = option('encoder', 'encoder or ideal', 'VALUE')
    nav: str = option('embedded', 'embedded, upstream or scripted', 'VALUE')
    slam: str = option('none', 'none, embedded or upstream', 'VALUE')
    save_map: str = option('', 'path without suffix for the map from SLAM (default: not saved)', 'VALUE')
    map: str = option('', 'map .yaml file (default: the one next to the world)', 'VALUE')
    bag: str = option('', 'path of the bag to record, or none (default: a new name in bags/)', 'VALUE')
    unchecked: str = option('false', 'true: skip the robot self-check and the fit to the test', 'VALUE')
    robot: str = option('alto', ROBOT, 'VALUE')
    sim: str = option('pybullet', 'pybullet or gazebo', 'VALUE')
