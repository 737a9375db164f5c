import numpy as np
import pytest

from diff_encoder_sim.robots.description import MassProperties
from diff_encoder_sim.robots.robot_tree import Box, Cylinder, Inertial, Sphere
from diff_encoder_sim.robots.solids import homogeneous, link_mass, merged
from robot_parts import inertial, pose, random_pose, random_rotation, shape

NOTHING = MassProperties(0.0, np.zeros(3), np.zeros((3, 3)))


def assert_same(found, expected):
    for value, right in zip(found, expected):
        assert value == pytest.approx(right, rel=1e-9, abs=1e-12)


def random_body(rng):
    """Six point masses: an inertia that a body can have."""
    masses_kg, points_m = rng.uniform(0.1, 2, 6), rng.normal(size=(6, 3))
    return merged(MassProperties(mass, point, np.zeros((3, 3))) for mass, point in zip(masses_kg, points_m))


def moved(body, by):
    return link_mass(Inertial(*body), by)


def test_two_point_masses_are_a_dumbbell():
    points = [MassProperties(3.0, np.array([x, 0, 0]), np.zeros((3, 3))) for x in (0.0, 2.0)]
    assert_same(merged(points), (6.0, [1, 0, 0], np.diag([0, 6, 6])))


@pytest.mark.parametrize(
    ('geometry', 'moments'),
    [
        (Box((2, 3, 4)), [12 / 12 * 25, 12 / 12 * 20, 12 / 12 * 13]),
        (Cylinder(2, 3), [12 / 12 * (3 * 4 + 9), 12 / 12 * (3 * 4 + 9), 12 / 2 * 4]),
        (Sphere(2), [0.4 * 12 * 4] * 3),
    ],
)
def test_homogeneous_solids_have_the_inertia_of_the_textbook(geometry, moments):
    assert_same(homogeneous([shape(geometry)], 12.0), (12.0, [0, 0, 0], np.diag(moments)))


def test_a_box_in_two_halves_is_the_box():
    halves = [shape(Box((1, 3, 4)), (x, 5, 6)) for x in (0.5, 1.5)]
    assert_same(homogeneous(halves, 7.0), homogeneous([shape(Box((2, 3, 4)), (1, 5, 6))], 7.0))


def test_a_larger_shape_gets_more_of_the_mass():
    parts = [shape(Box((1, 1, 1))), shape(Box((1, 1, 3)), (4, 0, 0))]
    assert homogeneous(parts, 1.0).com_m == pytest.approx([3, 0, 0])


def test_a_shape_that_is_turned_turns_its_inertia():
    upright = homogeneous([shape(Box((2, 3, 4)))], 12.0)
    lying = homogeneous([shape(Box((2, 3, 4)), (1, 2, 3), (np.pi / 2, 0, 0))], 12.0)
    assert_same(lying, (12.0, [1, 2, 3], np.diag(np.diag(upright.inertia_kgm2)[[0, 2, 1]])))


def test_without_shapes_20_g_are_a_ball_of_17_mm():
    ball = homogeneous((), 0.02)
    assert np.sqrt(ball.inertia_kgm2[0, 0] / 0.4 / ball.mass_kg) == pytest.approx(0.0168, abs=1e-4)


def test_nothing_weighs_nothing():
    assert_same(merged([]), NOTHING)


def test_a_frame_turned_and_moved_changes_no_principal_moment():
    rng = np.random.default_rng(6)
    for _ in range(50):
        body, by = random_body(rng), random_pose(rng)
        elsewhere = moved(body, by)
        assert np.linalg.eigvalsh(elsewhere.inertia_kgm2) == pytest.approx(np.linalg.eigvalsh(body.inertia_kgm2))
        assert elsewhere.com_m == pytest.approx((by @ [*body.com_m, 1])[:3])


def test_pieces_joined_in_any_order_and_any_frame_are_the_same_body():
    rng = np.random.default_rng(7)
    for _ in range(50):
        bodies, by = [random_body(rng) for _ in range(4)], random_pose(rng)
        whole = merged(bodies)
        assert_same(merged([merged(bodies[2:]), merged(bodies[:2])]), whole)
        assert_same(merged(moved(body, by) for body in bodies), moved(whole, by))


def test_a_solid_cut_into_pieces_with_frames_of_their_own_is_the_solid():
    """A URDF's way to say it: a pose of the link, and in it a centre of mass and an inertia along the link's axes."""
    rng = np.random.default_rng(8)
    whole = homogeneous([shape(Box((0.4, 0.2, 0.1)))], 8.0)
    pieces = []
    for corner in np.ndindex(2, 2, 2):
        centre_m = (np.array(corner) - 0.5) * [0.2, 0.1, 0.05]
        frame = random_pose(rng)
        turn = frame[:3, :3]
        inertia = turn.T @ homogeneous([shape(Box((0.2, 0.1, 0.05)))], 1.0).inertia_kgm2 @ turn
        pieces.append(link_mass(Inertial(1.0, turn.T @ (centre_m - frame[:3, 3]), inertia), frame))
    assert_same(merged(pieces), whole)


def test_a_link_keeps_its_mass_and_centre():
    body = link_mass(inertial(2.0, 0.1, (1, 0, 0)), pose((0, 0, 3), (0, 0, np.pi / 2)))
    assert_same(body, (2.0, [0, 1, 3], 0.1 * np.eye(3)))
    turned = Inertial(2.0, np.zeros(3), random_rotation(np.random.default_rng(9)))
    assert link_mass(turned, np.eye(4)).inertia_kgm2 == pytest.approx(turned.inertia_kgm2)
