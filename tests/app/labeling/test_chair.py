"""One page at a time sits before a session."""

from app.labeling.chair import Chair


def test_the_newest_page_takes_the_place():
    chair, told = Chair(), []
    chair.sit("a", lambda: told.append("a"))
    assert told == []
    chair.sit("b", lambda: told.append("b"))
    assert told == ["a"]
    chair.sit("c", lambda: told.append("c"))
    assert told == ["a", "b"]


def test_who_comes_back_after_a_newer_page_has_come_gives_way():
    chair, told = Chair(), []
    chair.sit("a", lambda: told.append("a"))()  # its connection broke
    chair.sit("b", lambda: told.append("b"))
    stand_up = chair.sit("a", lambda: told.append("a again"))
    assert told == ["a again"]
    stand_up()
    chair.sit("c", lambda: told.append("c"))
    assert told == ["a again", "b"]


def test_a_page_that_comes_back_does_not_drive_itself_out():
    chair, told = Chair(), []
    stand_up = chair.sit("a", lambda: told.append("lost connection"))
    chair.sit("a", lambda: told.append("a"))
    stand_up()  # of the lost connection, which ends later
    chair.sit("b", lambda: told.append("b"))
    assert told == ["a"]


def test_who_left_is_not_told():
    chair, told = Chair(), []
    chair.sit("a", lambda: told.append("a"))()
    chair.sit("b", lambda: told.append("b"))
    assert told == []
