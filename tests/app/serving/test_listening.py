"""The one public port and its address."""

import asyncio
import socket

import pytest

from app.config import Settings
from app.serving.listening import listen, sign_in_link
from tests.processes import failure, run_snap6d


@pytest.mark.parametrize(
    ("settings", "expected"),
    [
        ({}, "http://localhost:8123/sign-in#S"),
        ({"host": "0.0.0.0"}, "http://localhost:8123/sign-in#S"),
        ({"host": "192.0.2.7"}, "http://192.0.2.7:8123/sign-in#S"),
        ({"public_url": "https://snap.example/"}, "https://snap.example/sign-in#S"),
        ({"host": "2001:db8::7"}, "http://[2001:db8::7]:8123/sign-in#S"),
    ],
)
def test_the_link_can_be_opened_where_the_browser_is(settings, expected):
    assert sign_in_link(Settings(**settings), 8123, "S") == expected


def test_a_port_in_use_is_said_before_anything_is_started(tmp_path):
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        message = failure(run_snap6d(tmp_path / "state", "serve", "--port", str(port), "--prepare"))
    assert message.startswith(f"port {port} on 127.0.0.1 cannot be used (Address already in use); stop what")
    assert "--port" in message
    assert not (tmp_path / "state").exists()


def test_an_address_of_another_machine_is_said(tmp_path):
    message = failure(run_snap6d(tmp_path, "serve", "--host", "192.0.2.7", "--port", "0"))
    assert message.startswith("port 0 on 192.0.2.7 cannot be used")


def test_answers_do_not_wait_to_be_gathered_into_larger_packets():
    async def accepted() -> int:
        found: asyncio.Future[int] = asyncio.get_running_loop().create_future()

        async def greet(_reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
            connection = writer.get_extra_info("socket")
            found.set_result(connection.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY))
            writer.close()

        listener = listen(Settings(port=0))
        async with await asyncio.start_server(greet, sock=listener):
            _, writer = await asyncio.open_connection(*listener.getsockname())
            no_delay = await found
            writer.close()
        return no_delay

    assert asyncio.run(accepted()) != 0
