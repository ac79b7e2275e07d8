"""One page at a time sits before a session."""

from app.labeling.live.page_lease import PageLease


def test_the_newest_page_takes_the_place():
    page_lease, told = PageLease(), []
    page_lease.take("a", lambda: told.append("a"))
    assert told == []
    page_lease.take("b", lambda: told.append("b"))
    assert told == ["a"]
    page_lease.take("c", lambda: told.append("c"))
    assert told == ["a", "b"]


def test_who_comes_back_after_a_newer_page_has_come_gives_way():
    page_lease, told = PageLease(), []
    page_lease.take("a", lambda: told.append("a"))()  # its connection broke
    page_lease.take("b", lambda: told.append("b"))
    release = page_lease.take("a", lambda: told.append("a again"))
    assert told == ["a again"]
    release()
    page_lease.take("c", lambda: told.append("c"))
    assert told == ["a again", "b"]


def test_a_page_that_comes_back_does_not_drive_itself_out():
    page_lease, told = PageLease(), []
    release = page_lease.take("a", lambda: told.append("lost connection"))
    page_lease.take("a", lambda: told.append("a"))
    release()  # of the lost connection, which ends later
    page_lease.take("b", lambda: told.append("b"))
    assert told == ["a"]


def test_who_left_is_not_told():
    page_lease, told = PageLease(), []
    page_lease.take("a", lambda: told.append("a"))()
    page_lease.take("b", lambda: told.append("b"))
    assert told == []
