"""What every floor builds on: rotations of many bodies, and teams of threads."""

import threading

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from particlesim.core.parallel import ALONE, ThreadTeam, available_threads, limit_threads, use_threads
from particlesim.core.rotations import conjugates, quaternion_products, quaternions_of, rotations_of


@pytest.fixture
def quaternions():
    q = np.random.default_rng(1).normal(size=(2, 50, 4))
    return q / np.linalg.norm(q, axis=2, keepdims=True)


def test_products_and_inverses_are_those_of_rotation_matrices(quaternions):
    p, q = quaternions
    turn_p, turn_q = rotations_of(p).as_matrix(), rotations_of(q).as_matrix()
    for one in (q, q[0]):
        back = quaternions_of(rotations_of(one))
        assert np.abs((back * one).sum(axis=-1)) == pytest.approx(1.0)
    np.testing.assert_allclose(rotations_of(quaternion_products(p, q)).as_matrix(), turn_p @ turn_q, atol=1e-14)
    np.testing.assert_allclose(rotations_of(conjugates(q)).as_matrix(), np.swapaxes(turn_q, 1, 2), atol=1e-14)
    assert quaternions_of(Rotation.from_rotvec([0.0, 0.0, 4.0]), canonical=True)[0] > 0.0


def test_a_team_has_its_own_threads_or_those_of_the_code_around_it_or_of_the_process():
    usual = available_threads()
    try:
        use_threads(3)
        assert ThreadTeam(ALONE).threads == 3
        with limit_threads(2):
            assert ThreadTeam(ALONE).threads == 2
            assert ThreadTeam(ALONE, threads=5).threads == 5
            assert ThreadTeam(ALONE - 1, threads=5).threads == 1
            with limit_threads(None):
                assert ThreadTeam(ALONE).threads == 2
        assert ThreadTeam(ALONE).threads == 3
    finally:
        use_threads(None)
    assert available_threads() == usual


def test_code_that_runs_at_the_same_time_keeps_its_own_number_of_threads():
    both_inside, seen = threading.Barrier(2), {}

    def work(count):
        with limit_threads(count):
            both_inside.wait()
            seen[count] = ThreadTeam(ALONE).threads
            both_inside.wait()

    workers = [threading.Thread(target=work, args=(count,)) for count in (2, 4)]
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join()
    assert seen == {2: 2, 4: 4}


@pytest.mark.parametrize("count", [0, -1, 4097, 2**62, pytest.param(10**5000, id="huge")])
def test_what_no_machine_has_of_threads_is_refused(count):
    for refused in (use_threads, lambda n: ThreadTeam(1, n), lambda n: limit_threads(n).__enter__()):
        with pytest.raises(ValueError, match=r"^the number of threads must be 1 to 4,096, not "):
            refused(count)
