"""Runs that are killed at any moment go on as if they had not been: the same state, trajectory, pictures and bytes.

KILLS=50 pytest -m slow tests/test_kills.py -s kills fifty of each kind, and shows where; KILLS_SEED chooses others.
"""

import collections
import os

import pytest

from tests import killed

KILLS = int(os.environ.get("KILLS", "4"))
SEED = int(os.environ.get("KILLS_SEED", "17"))


@pytest.mark.slow
@pytest.mark.parametrize("name", ["run.gsd", "movie.mp4"])
def test_killed_in_any_part_it_ends_as_if_it_had_not_been(tmp_path, name):
    scene, path = tmp_path / "scene.toml", tmp_path / name
    scene.write_text(killed.SCENE)
    ended, midst = [], collections.Counter()
    for victims, said in killed.kills(scene, path, KILLS, SEED):
        found = said["hash"], killed.content(path), killed.bytes_of(path)
        ended.append(found)
        for victim in victims:
            midst[f"{victim.aim}: in {' '.join(victim.midst) or 'between'}"] += 1
            print(victim, found == ended[0], flush=True)
        assert found == ended[0], victims
        assert not list(tmp_path.glob(".*"))
    total = sum(midst.values())
    print(f"{name}: {total} kills, {len(ended) - 1} runs ended, all the same:", *sorted(midst.items()), sep="\n  ")
    assert total >= KILLS
