"""Who may do what: users, roles, passwords, login sessions, API tokens and one-time sign-in links."""

import hashlib
import math
import secrets
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import timedelta
from functools import cached_property

from pwdlib import PasswordHash
from sqlalchemy import delete, select
from sqlalchemy.orm import Session

from app.access.throttle import Throttle
from app.storage.database import Database
from app.storage.roles import Actor, Role
from app.storage.tables import Credential, User, utc_now

LOCAL_ADMINISTRATOR = "admin"
"""Whoever runs commands on the machine of the server."""
LOGIN_LIFETIME = timedelta(days=14)
LINK_LIFETIME = timedelta(hours=12)
CHECKS_AT_ONCE = 2
"""Passwords that are hashed at a time; ..."""
CHECKS_WAITING = 8
"""... and that wait for it, each keeping a thread of the server."""
SHORTEST_PASSWORD = 8


@dataclass(frozen=True)
class Identity:
    """Whoever a request comes from."""

    user_id: int
    name: str
    role: Role
    actor: Actor


class SignInError(Exception):
    """The credentials are not accepted; the message may be shown."""


class TooManyAttemptsError(SignInError):
    """Signing in has to wait."""


class Auth:
    """Users and their credentials in the database; only hashes of secrets are kept.

    Args:
        database: Where they are.
        throttle: Counts wrong passwords; in memory where it is None.
    """

    def __init__(self, database: Database, throttle: Throttle | None = None) -> None:
        self._database = database
        self._passwords = PasswordHash.recommended()
        self._throttle = throttle or Throttle()
        self._checks = _PasswordChecks()

    def create_user(self, name: str, role: Role, password: str | None = None) -> User:
        """Add a user; without a password only links and tokens sign in.

        Raises:
            ValueError: where the name is empty or taken, or the password too short.
        """
        name = name.strip()
        if not name:
            raise ValueError("a user's name must not be empty")
        if password is not None and len(password) < SHORTEST_PASSWORD:
            raise ValueError(f"a password needs at least {SHORTEST_PASSWORD} characters")
        with self._database.write() as session:
            if _find_user(session, name):
                raise ValueError(f"there already is a user named {name!r}; choose another name")
            user = User(name=name, role=role, password_hash=password and self._passwords.hash(password))
            session.add(user)
            session.flush()
            return user

    def user(self, name: str) -> User:
        """The user of this name.

        Raises:
            ValueError: where there is none.
        """
        with self._database.read() as session:
            user = _find_user(session, name)
        if user is None:
            raise ValueError(f"there is no user {name!r}")
        return user

    def ensure_user(self, name: str, role: Role) -> User:
        """The user of this name, made where there is none.

        Raises:
            ValueError: where the user exists with another role.
        """
        with self._database.read() as session:
            user = _find_user(session, name)
        if user is None:
            return self.create_user(name, role)
        if user.role != role:
            raise ValueError(f"user {name!r} has the role {user.role}, not {role}; choose another name")
        return user

    def sign_in(self, name: str, password: str, address: str) -> str:
        """A new login session's secret, for the right name and password, asked for from a network address.

        Raises:
            SignInError: where they are wrong, or were wrong too often just now.
        """
        name = name.strip()
        with self._checks.one():
            wait = self._throttle.attempt(name, address)
            if wait > 0:
                raise TooManyAttemptsError(
                    f"too many wrong passwords; wait {math.ceil(wait)} seconds and try again"
                )
            user = self._user_with_password(name, password)
        if user is None:
            raise SignInError("this name and password do not belong together; check both and try again")
        self._throttle.succeeded(name, address)
        return self._issue("session", user.id, LOGIN_LIFETIME)

    def sign_in_with_link(self, secret: str) -> str:
        """A new login session's secret for a one-time link, which is used up by it.

        Raises:
            SignInError: where the link is unknown, used or too old.
        """
        with self._database.write() as session:
            link = _find_credential(session, "link", secret)
            if link is None:
                raise SignInError("this sign-in link was used before or is too old; ask for a new one")
            session.delete(link)
            return add_credential(session, "session", link.user_id, LOGIN_LIFETIME)

    def sign_in_to_study(self, secret: str) -> str:
        """A new login session's secret for a participant's link, which can be used again.

        Raises:
            SignInError: where the link is unknown, the participant has withdrawn, or the study is closed.
        """
        with self._database.write() as session:
            link = _find_credential(session, "participant", secret)
            if link is None:
                raise SignInError(
                    "this link is not valid: the study is closed, you have withdrawn, or there is a newer"
                    " link; ask whoever gave it to you"
                )
            return add_credential(session, "session", link.user_id, LOGIN_LIFETIME)

    def sign_out(self, secret: str) -> None:
        """End a login session; any other secret is left alone."""
        with self._database.write() as session:
            session.execute(delete(Credential).filter_by(kind="session", secret_hash=_hashed(secret)))

    def close(self) -> None:
        """Close what is not the database's."""
        self._throttle.close()

    def create_link(self, user_id: int) -> str:
        """The secret of a new one-time sign-in link."""
        return self._issue("link", user_id, LINK_LIFETIME)

    def create_token(self, name: str, role: Role) -> str:
        """A new API token for the user `name`, who is made where there is none."""
        return self._issue("token", self.ensure_user(name, role).id, None, name)

    def identify_session(self, secret: str) -> Identity | None:
        """Whose login session this is."""
        return self._identify("session", secret, Actor.HUMAN)

    def identify_token(self, secret: str) -> Identity | None:
        """Whose API token this is."""
        return self._identify("token", secret, Actor.SCRIPT)

    def _user_with_password(self, name: str, password: str) -> User | None:
        """The user of this name, where the password is theirs.

        An unknown name costs the same work as a known one, so that names cannot be guessed by the clock.
        """
        with self._database.read() as session:
            user = _find_user(session, name)
        kept = user.password_hash if user is not None else None
        nobodys = self._nobodys_hash  # made in the first attempt, whoever it is of
        is_right = self._passwords.verify(password, kept or nobodys)
        return user if is_right and kept else None

    @cached_property
    def _nobodys_hash(self) -> str:
        """Of a password that nobody has; most commands check none, and it takes a quarter of a second."""
        return self._passwords.hash(secrets.token_urlsafe())

    def _identify(self, kind: str, secret: str, actor: Actor) -> Identity | None:
        with self._database.read() as session:
            credential = _find_credential(session, kind, secret)
        if credential is None:
            return None
        user = credential.user
        return Identity(user.id, user.name, Role(user.role), actor)

    def _issue(self, kind: str, user_id: int, lifetime: timedelta | None, name: str = "") -> str:
        with self._database.write() as session:
            return add_credential(session, kind, user_id, lifetime, name)


class _PasswordChecks:
    """Lets few passwords be hashed at a time: each takes 64 MB and a core."""

    def __init__(self) -> None:
        self._places = threading.BoundedSemaphore(CHECKS_AT_ONCE + CHECKS_WAITING)
        self._running = threading.BoundedSemaphore(CHECKS_AT_ONCE)

    @contextmanager
    def one(self) -> Iterator[None]:
        """Do one, after those before; raises `TooManyAttemptsError` where too many wait already."""
        if not self._places.acquire(blocking=False):
            raise TooManyAttemptsError("too many people sign in at this moment; try again in some seconds")
        try:
            with self._running:
                yield
        finally:
            self._places.release()


def _hashed(secret: str) -> str:
    return hashlib.sha256(secret.encode()).hexdigest()


def _find_user(session: Session, name: str) -> User | None:
    return session.scalar(select(User).where(User.name == name.strip()))


def _find_credential(session: Session, kind: str, secret: str) -> Credential | None:
    credential = session.scalar(
        select(Credential).where(Credential.kind == kind, Credential.secret_hash == _hashed(secret))
    )
    if credential is None or (credential.expires_at is not None and credential.expires_at < utc_now()):
        return None
    return credential


def add_credential(
    session: Session, kind: str, user_id: int, lifetime: timedelta | None, name: str = ""
) -> str:
    """The secret of a new credential, within a transaction; those that have expired are cleared away."""
    secret = secrets.token_urlsafe(32)
    session.execute(delete(Credential).where(Credential.expires_at < utc_now()))
    session.add(
        Credential(
            kind=kind,
            secret_hash=_hashed(secret),
            user_id=user_id,
            name=name,
            expires_at=utc_now() + lifetime if lifetime else None,
        )
    )
    return secret
