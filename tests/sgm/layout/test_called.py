"""Which furniture is exactly of a name: by all that is said of it, else by less and less."""

import pytest

from sgm import SceneGraphMemory
from sgm.layout.called import CalledFurniture
from sgm.names.name import Name


@pytest.fixture
def memory():
    memory = SceneGraphMemory()
    kitchen, hall = memory.add_room("kitchen"), memory.add_room("hall")
    memory.add_furniture("fridge", kitchen, "white fridge")  # 0
    memory.add_furniture("table", kitchen)  # 1
    memory.add_furniture("table", hall)  # 2
    memory.add_furniture("fridge", hall, "hall table")  # 3: called as another one is labelled
    return memory


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("white fridge in kitchen", [0]),
        ("The White Fridges", [0]),
        ("kitchen white fridge", [0]),
        ("kitchen fridge", [0]),
        ("fridge in the kitchen", [0]),
        ("fridge", [0, 3]),
        ("tables", [1, 2]),
        ("table in hall", [2]),
        ("hall table", [3]),  # its description comes before room and description of 2
        ("hall fridge", [3]),
        ("sofa", []),
    ],
)
def test_what_says_more_comes_first(memory, name, expected):
    assert memory.find_called(Name.read(name)) == expected
    called = CalledFurniture(memory.layout)
    assert [called.find(Name.read(name)) for _ in range(2)] == [expected] * 2


def test_names_follow_the_furniture(memory):
    def find(name):
        return memory.find_called(Name.read(name))

    assert find("sofa") == []
    sofa = memory.add_furniture("sofa", next(iter(memory.layout.rooms)))
    assert find("sofa") == [sofa]
    memory.forget(sofa)
    assert find("sofa") == []
