"""Users, passwords, links, tokens: what signs in, what does not, and what the database keeps of it."""

import threading
from datetime import timedelta
from types import SimpleNamespace

import pytest
from sqlalchemy import select, text

from app.auth import FREE_ATTEMPTS, Actor, Auth, Identity, Role, SignInError, TooManyAttemptsError
from app.database import Database
from app.tables import Credential, utc_now

PASSWORD = "correct horse battery"


@pytest.fixture
def auth(database: Database) -> Auth:
    return Auth(database)


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
    secret = auth.sign_in("ann", PASSWORD)
    assert auth.identify_session(secret) == Identity(user.id, "ann", Role.REVIEWER, Actor.HUMAN)
    assert auth.sign_in("ann", PASSWORD) != secret


@pytest.mark.parametrize(
    ("name", "password"),
    [("ann", "wrong"), ("ann", ""), ("nobody", PASSWORD), ("linked", ""), ("Ann", PASSWORD)],
)
def test_wrong_credentials_all_get_the_same_answer(auth, name, password):
    auth.create_user("ann", Role.OPERATOR, PASSWORD)
    auth.create_user("linked", Role.OPERATOR)
    with pytest.raises(SignInError, match="do not belong together"):
        auth.sign_in(name, password)


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
    monkeypatch.setattr("app.auth.time", SimpleNamespace(monotonic=lambda: now))
    auth.create_user("ann", Role.OPERATOR, PASSWORD)
    auth.create_user("bob", Role.OPERATOR, PASSWORD)

    def guess() -> type[SignInError]:
        with pytest.raises(SignInError) as caught:
            auth.sign_in("ann", "wrong")
        return caught.type

    assert [guess() for _ in range(FREE_ATTEMPTS)] == [SignInError] * FREE_ATTEMPTS
    for wait in (1.0, 2.0, 4.0):
        with pytest.raises(TooManyAttemptsError, match="wait"):
            auth.sign_in("ann", PASSWORD)
        now += wait * 0.9
        assert guess() is TooManyAttemptsError
        now += wait * 0.2
        assert guess() is SignInError
    auth.sign_in("bob", PASSWORD)  # another name does not wait
    now += 300.0
    auth.sign_in("ann", PASSWORD)
    assert guess() is SignInError  # and after success counting starts anew
    auth.sign_in("ann", PASSWORD)


def test_spelling_a_name_with_spaces_does_not_buy_more_guesses(auth):
    auth.create_user("ann", Role.OPERATOR, PASSWORD)
    for i in range(FREE_ATTEMPTS):
        with pytest.raises(SignInError):
            auth.sign_in("ann" + " " * i, "wrong")
    with pytest.raises(TooManyAttemptsError):
        auth.sign_in("  ann", "wrong")


def test_signing_out_ends_this_session_only(auth):
    auth.create_user("ann", Role.OPERATOR, PASSWORD)
    first, second = auth.sign_in("ann", PASSWORD), auth.sign_in("ann", PASSWORD)
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
    session, link = auth.sign_in("ann", PASSWORD), auth.create_link(user.id)
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
        auth.sign_in("ann", PASSWORD),
        auth.create_link(user.id),
        auth.create_token("robot", Role.OPERATOR),
    ]
    kept = everything_kept(database)
    assert "ann" in kept and "$argon2id$" in kept
    assert not [secret for secret in secrets if secret in kept]
    assert len({len(secret) >= 43 for secret in secrets[1:]}) == 1
