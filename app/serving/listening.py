"""The one public port and its address."""

import socket

from app.config import Settings


class ServeError(Exception):
    """The server cannot start; the message says why and what to do."""


def listen(settings: Settings) -> socket.socket:
    """The socket that the server is to listen on.

    Raises:
        ServeError: where the address or the port cannot be had.
    """
    family = socket.AF_INET6 if ":" in settings.host else socket.AF_INET
    # Named, or asyncio leaves connections to gather small packets, and every answer is 40 ms late.
    listener = socket.socket(family, socket.SOCK_STREAM, socket.IPPROTO_TCP)
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listener.bind((settings.host, settings.port))
        listener.listen(128)
    except OSError as error:
        listener.close()
        raise ServeError(
            f"port {settings.port} on {settings.host} cannot be used ({error.strerror});"
            " stop what uses it, or choose another with --port"
        ) from error
    return listener


def sign_in_link(settings: Settings, port: int, secret: str) -> str:
    """Address that signs in, once; the secret stays behind the # and so out of every server's log."""
    host = "localhost" if settings.host in {"127.0.0.1", "0.0.0.0", "::", "localhost"} else settings.host
    named = f"[{host}]" if ":" in host else host  # an IPv6 address
    base = settings.public_url.rstrip("/") or f"http://{named}:{port}"
    return f"{base}/sign-in#{secret}"
