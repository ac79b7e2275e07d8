"""Users, passwords, links, tokens: what signs in, what does not, and what the database keeps of it."""

import threading
from collections.abc import Iterator
from datetime import timedelta
from types import SimpleNamespace

import pytest
from pwdlib import PasswordHash
from pwdlib.hashers.argon2 import Argon2Hasher
from sqlalchemy import select, text

from app.access.auth import CHECKS_AT_ONCE, CHECKS_WAITING, Auth, Identity, SignInError, TooManyAttemptsError
from app.access.throttle import FREE_ATTEMPTS, Throttle
from app.storage.database import Database
from app.storage.roles import Actor, Role
from app.storage.tables import Credential, utc_now
from tests.app.waiting import LONGEST, wait_until

PASSWORD = "correct horse battery"
HERE, ELSEWHERE = "192.0.2.1", "198.51.100.7"


@pytest.fixture
def auth(database: Database, monkeypatch: pytest.MonkeyPatch) -> Iterator[Auth]:
    """Hashes passwords as any, but at the least cost."""
    cheap = PasswordHash((Argon2Hasher(time_cost=1, memory_cost=8, parallelism=1),))
    with monkeypatch.context() as patched:
        patched.setattr(PasswordHash, "recommended", lambda: cheap)
        opened = Auth(database)
    yield opened
    opened.close()


@pytest.fixture
def still(monkeypatch: pytest.MonkeyPatch) -> None:
    """No time passes for who has to wait."""
    monkeypatch.setattr("app.access.throttle.time", SimpleNamespace(time=lambda: 1000.0))


def everything_kept(database: Database) -> str:
    """All text in the tables about users."""
    with database.read() as session:
        rows = [
            *session.execute(text("SELECT * FROM users")),
            *session.execute(text("SELECT * FROM credentials")),
        ]
    return "\n".join(map(repr, rows))


def age(database: Database, kind: str) -> None:
    """Let all credentials of a kind have expired a moment ago."""
    with database.write() as session:
        for row in session.scalars(select(Credential).where(Credential.kind == kind)):
            row.expires_at = utc_now() - timedelta(seconds=1)


def test_each_role_may_do_what_the_ones_before_it_may():
    table = {(a, b): a.includes(b) for a in Role for b in Role}
    assert table == {
        (Role.PARTICIPANT, Role.PARTICIPANT): True,
        (Role.PARTICIPANT, Role.OPERATOR): False,
        (Role.PARTICIPANT, Role.REVIEWER): False,
        (Role.PARTICIPANT, Role.ADMIN): False,
        (Role.OPERATOR, Role.PARTICIPANT): True,
        (Role.REVIEWER, Role.PARTICIPANT): True,
        (Role.ADMIN, Role.PARTICIPANT): True,
        (Role.OPERATOR, Role.OPERATOR): True,
        (Role.OPERATOR, Role.REVIEWER): False,
        (Role.OPERATOR, Role.ADMIN): False,
        (Role.REVIEWER, Role.OPERATOR): True,
        (Role.REVIEWER, Role.REVIEWER): True,
        (Role.REVIEWER, Role.ADMIN): False,
        (Role.ADMIN, Role.OPERATOR): True,
        (Role.ADMIN, Role.REVIEWER): True,
        (Role.ADMIN, Role.ADMIN): True,
    }


# -- passwords


def test_the_right_password_signs_in(auth):
    user = auth.create_user(" ann ", Role.REVIEWER, PASSWORD)
    secret = auth.sign_in("ann", PASSWORD, HERE)
    assert auth.identify_session(secret) == Identity(user.id, "ann", Role.REVIEWER, Actor.HUMAN)
    assert auth.sign_in("ann", PASSWORD, HERE) != secret


def test_passwords_are_hashed_at_the_cost_that_is_recommended(database):
    user = Auth(database).create_user("ann", Role.OPERATOR, PASSWORD)
    kept, recommended = (
        str(made).split("$") for made in (user.password_hash, PasswordHash.recommended().hash("any"))
    )
    assert kept[1:4] == recommended[1:4]


@pytest.mark.parametrize(
    ("name", "password"),
    [("ann", "wrong"), ("ann", ""), ("nobody", PASSWORD), ("linked", ""), ("Ann", PASSWORD)],
)
def test_wrong_credentials_all_get_the_same_answer(auth, name, password):
    auth.create_user("ann", Role.OPERATOR, PASSWORD)
    auth.create_user("linked", Role.OPERATOR)
    with pytest.raises(SignInError, match="do not belong together"):
        auth.sign_in(name, password, HERE)


def test_bad_names_and_passwords_are_refused(auth):
    auth.create_user("ann", Role.OPERATOR)
    for name, password, message in [
        ("  ", None, "must not be empty"),
        ("ann", None, "already is a user named 'ann'"),
        (" ann ", None, "already is a user"),
        ("bob", "1234567", "at least 8 characters"),
    ]:
        with pytest.raises(ValueError, match=message):
            auth.create_user(name, Role.OPERATOR, password)


def test_guessing_has_to_wait_longer_and_longer(auth, monkeypatch):
    now = 1000.0
    monkeypatch.setattr("app.access.throttle.time", SimpleNamespace(time=lambda: now))
    auth.create_user("ann", Role.OPERATOR, PASSWORD)
    auth.create_user("bob", Role.OPERATOR, PASSWORD)

    def guess() -> type[SignInError]:
        with pytest.raises(SignInError) as caught:
            auth.sign_in("ann", "wrong", HERE)
        return caught.type

    assert [guess() for _ in range(FREE_ATTEMPTS)] == [SignInError] * FREE_ATTEMPTS
    for wait in (1.0, 2.0, 4.0):
        with pytest.raises(TooManyAttemptsError, match="wait"):
            auth.sign_in("ann", PASSWORD, HERE)
        now += wait * 0.9
        assert guess() is TooManyAttemptsError
        now += wait * 0.2
        assert guess() is SignInError
    auth.sign_in("bob", PASSWORD, HERE)  # another name does not wait
    now += 300.0
    auth.sign_in("ann", PASSWORD, HERE)
    assert guess() is SignInError  # and after success counting starts anew
    auth.sign_in("ann", PASSWORD, HERE)


def test_spelling_a_name_with_spaces_does_not_buy_more_guesses(auth, still):
    auth.create_user("ann", Role.OPERATOR, PASSWORD)
    for i in range(FREE_ATTEMPTS):
        with pytest.raises(SignInError):
            auth.sign_in("ann" + " " * i, "wrong", HERE)
    with pytest.raises(TooManyAttemptsError):
        auth.sign_in("  ann", "wrong", HERE)


def test_a_stranger_who_guesses_locks_nobody_out(auth, still):
    auth.create_user("ann", Role.OPERATOR, PASSWORD)
    for _ in range(FREE_ATTEMPTS):
        with pytest.raises(SignInError, match="do not belong together"):
            auth.sign_in("ann", "wrong", ELSEWHERE)
    with pytest.raises(TooManyAttemptsError):
        auth.sign_in("ann", "wrong", ELSEWHERE)
    auth.sign_in("ann", PASSWORD, HERE)
    with pytest.raises(TooManyAttemptsError):  # and that she came in frees nobody elsewhere
        auth.sign_in("ann", "wrong", ELSEWHERE)


def test_a_restart_does_not_buy_more_guesses(database, still, tmp_path):
    def guess_after_a_restart() -> type[SignInError]:
        opened = Auth(database, Throttle(tmp_path / "throttle.sqlite"))
        with pytest.raises(SignInError) as caught:
            opened.sign_in("ann", "wrong", HERE)
        opened.close()
        return caught.type

    found = [guess_after_a_restart() for _ in range(FREE_ATTEMPTS + 1)]
    assert found == [SignInError] * FREE_ATTEMPTS + [TooManyAttemptsError]


class CountingHasher:
    """Verifies as the real one does, and tells against what; `go_on` holds it up."""

    def __init__(self) -> None:
        self._verify = PasswordHash.verify
        self.go_on = threading.Event()
        self.go_on.set()
        self.hashes: list[str] = []

    def verify(self, real: PasswordHash, password: str, expected: str) -> bool:
        self.hashes.append(expected)
        assert self.go_on.wait(LONGEST)
        return self._verify(real, password, expected)


@pytest.fixture
def hasher(monkeypatch: pytest.MonkeyPatch) -> CountingHasher:
    counting = CountingHasher()
    monkeypatch.setattr(PasswordHash, "verify", lambda *args: counting.verify(*args))  # noqa: PLW0108 - a function binds, a method does not
    return counting


def test_an_unknown_name_costs_the_work_of_a_known_one(auth, hasher):
    auth.create_user("ann", Role.OPERATOR, PASSWORD)
    auth.create_user("linked", Role.OPERATOR)
    for name in ("ann", "nobody", "linked"):
        with pytest.raises(SignInError):
            auth.sign_in(name, "wrong", HERE)
    of_known, of_unknown, of_linked = (found.split("$")[1:4] for found in hasher.hashes)
    assert of_known == of_unknown == of_linked  # one hash each, by the same method at the same cost


def test_few_passwords_are_hashed_at_once_and_the_rest_is_told_to_come_again(auth, hasher):
    auth.create_user("ann", Role.OPERATOR, PASSWORD)
    hasher.go_on.clear()
    outcomes: list[str] = []

    def sign_in(index: int) -> None:
        try:
            outcomes.append(auth.sign_in("ann", PASSWORD, f"192.0.2.{index}") and "in")
        except TooManyAttemptsError as error:
            outcomes.append(str(error))

    threads = [threading.Thread(target=sign_in, args=(index,)) for index in range(40)]
    for thread in threads:
        thread.start()
    allowed = CHECKS_AT_ONCE + CHECKS_WAITING
    wait_until(lambda: len(outcomes) == 40 - allowed, "all but those that wait to be refused")
    assert all("try again in some seconds" in outcome for outcome in outcomes)
    wait_until(lambda: len(hasher.hashes) == CHECKS_AT_ONCE, "the first ones to be hashed")
    hasher.go_on.set()
    for thread in threads:
        thread.join()
    assert outcomes.count("in") == allowed == len(hasher.hashes)


def test_of_many_guesses_at_once_none_slips_through(auth, still):
    barrier = threading.Barrier(CHECKS_AT_ONCE + CHECKS_WAITING)
    outcomes: list[type[SignInError]] = []

    def guess() -> None:
        barrier.wait()
        with pytest.raises(SignInError) as caught:
            auth.sign_in("ann", "wrong", HERE)
        outcomes.append(caught.type)

    threads = [threading.Thread(target=guess) for _ in range(barrier.parties)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert outcomes.count(SignInError) == FREE_ATTEMPTS


def test_signing_out_with_a_token_leaves_the_token(auth):
    token = auth.create_token("robot", Role.OPERATOR)
    auth.sign_out(token)
    assert auth.identify_token(token).name == "robot"


def test_signing_out_ends_this_session_only(auth):
    auth.create_user("ann", Role.OPERATOR, PASSWORD)
    first, second = auth.sign_in("ann", PASSWORD, HERE), auth.sign_in("ann", PASSWORD, HERE)
    auth.sign_out(first)
    assert auth.identify_session(first) is None
    assert auth.identify_session(second) is not None
    auth.sign_out("never issued")


# -- links


def test_a_link_signs_in_once(auth):
    user = auth.create_user("ann", Role.OPERATOR)
    link = auth.create_link(user.id)
    assert auth.identify_session(auth.sign_in_with_link(link)).name == "ann"
    for _ in range(2):
        with pytest.raises(SignInError, match="used before or is too old"):
            auth.sign_in_with_link(link)


def test_of_many_who_use_a_link_at_once_one_gets_in(auth):
    link = auth.create_link(auth.create_user("ann", Role.OPERATOR).id)
    barrier = threading.Barrier(8)
    outcomes: list[str] = []

    def use() -> None:
        barrier.wait()
        try:
            outcomes.append(auth.sign_in_with_link(link))
        except SignInError:
            outcomes.append("refused")

    threads = [threading.Thread(target=use) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert outcomes.count("refused") == 7


@pytest.mark.parametrize("kind", ["link", "session"])
def test_what_has_expired_signs_nobody_in(auth, database, kind):
    user = auth.create_user("ann", Role.OPERATOR)
    link = auth.create_link(user.id)
    secret = auth.sign_in_with_link(auth.create_link(user.id))
    age(database, kind)
    if kind == "link":
        with pytest.raises(SignInError, match="too old"):
            auth.sign_in_with_link(link)
    else:
        assert auth.identify_session(secret) is None


def test_expired_credentials_are_swept_out(auth, database):
    user = auth.create_user("ann", Role.OPERATOR)
    for _ in range(3):
        auth.create_link(user.id)
    age(database, "link")
    auth.create_token("robot", Role.OPERATOR)
    with database.read() as session:
        assert [row.kind for row in session.scalars(select(Credential))] == ["token"]


# -- tokens


def test_a_token_acts_as_a_script(auth):
    token = auth.create_token("robot", Role.ADMIN)
    identity = auth.identify_token(token)
    assert (identity.name, identity.role, identity.actor) == ("robot", Role.ADMIN, Actor.SCRIPT)
    assert auth.identify_token(auth.create_token("robot", Role.ADMIN)).user_id == identity.user_id
    with pytest.raises(ValueError, match="has the role admin, not operator"):
        auth.create_token("robot", Role.OPERATOR)


def test_a_secret_is_good_for_its_own_kind_only(auth):
    user = auth.create_user("ann", Role.OPERATOR, PASSWORD)
    session, link = auth.sign_in("ann", PASSWORD, HERE), auth.create_link(user.id)
    token = auth.create_token("ann", Role.OPERATOR)
    assert auth.identify_token(session) is None and auth.identify_token(link) is None
    assert auth.identify_session(token) is None and auth.identify_session(link) is None
    for secret in (session, token, ""):
        with pytest.raises(SignInError):
            auth.sign_in_with_link(secret)


def test_the_database_holds_hashes_only(auth, database):
    user = auth.create_user("ann", Role.OPERATOR, PASSWORD)
    secrets = [
        PASSWORD,
        auth.sign_in("ann", PASSWORD, HERE),
        auth.create_link(user.id),
        auth.create_token("robot", Role.OPERATOR),
    ]
    kept = everything_kept(database)
    assert "ann" in kept and "$argon2id$" in kept
    assert not [secret for secret in secrets if secret in kept]
    assert len({len(secret) >= 43 for secret in secrets[1:]}) == 1
