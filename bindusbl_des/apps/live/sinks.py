"""Where telegrams go: datagrams, clients of a port, a pseudo-terminal, a file.

What clients say is discarded, or heard where the sink is a wire (:mod:`.wire`).

None of them is ever waited for.  Who is too slow, or gone, loses telegrams or its connection; a
sink that cannot go on is said so once, and the mission goes on without it.
"""

import errno
import os
import resource
import selectors
import socket
import stat
import tty
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from time import monotonic
from typing import Protocol

LOOPBACK = "127.0.0.1"

# What is kept for a client that reads slowly (bytes), before it is dropped.
BACKLOG = 1 << 20

# Who may ask to be connected at once, and how much of what clients say is read at once (bytes).
WAITING, DISCARDED = 128, 1 << 16

# So many clients a port serves at once, and so many descriptors are left to the mission and its
# results; where none is left, a port listens again after so long (s).
MOST_CLIENTS, KEPT_BACK, RECOVERY_S = 64, 64, 1.0

Say = Callable[[str], None]

# Takes the bytes that one client says; a sink asks for one of its own for each.
Ear = Callable[[bytes], None]


def deaf() -> Ear:
    """Return what takes the bytes of a client that nothing listens to."""
    return lambda data: None


def leaves_room(descriptor: int) -> bool:
    """Tell whether enough descriptors are left beside a new one: the lowest are given first."""
    limit, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
    return limit == resource.RLIM_INFINITY or descriptor + KEPT_BACK < limit


def check_room() -> None:
    """Refuse to open one more sink where it would take what the mission needs.

    Raises:
        OSError: when too few descriptors are left.
    """
    with open(os.devnull, "rb") as probe:
        if not leaves_room(probe.fileno()):
            raise OSError(errno.EMFILE, "too few files may be open; raise `ulimit -n`")


class Sink(Protocol):
    """Where telegrams go; `name` is as the user gave it."""

    name: str

    def send(self, telegram: bytes) -> None:
        """Send a telegram, or lose it: never wait.

        Raises:
            OSError: when nothing can be sent any more.
        """

    @property
    def clients(self) -> int:
        """How many read it, as far as that is known."""

    def close(self) -> None:
        """Leave nothing behind."""


class Datagrams:
    """Sends each telegram as a datagram to HOST:PORT."""

    clients = 0

    def __init__(self, name: str, host: str, port: int) -> None:
        self.name = name
        found = socket.getaddrinfo(host, port, type=socket.SOCK_DGRAM)[0]
        family, self._address = found[0], found[4]
        self._socket = socket.socket(family, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, 1)

    def send(self, telegram: bytes) -> None:
        try:
            self._socket.sendto(telegram, self._address)
        except (BlockingIOError, ConnectionRefusedError):
            pass  # nobody reads it
        except OSError as error:
            if error.errno not in (errno.ENOBUFS, errno.ENETUNREACH, errno.EHOSTUNREACH):
                raise

    def close(self) -> None:
        self._socket.close()


class Port:
    """Listens on a TCP port, and sends each telegram to all that are connected."""

    def __init__(
        self,
        name: str,
        host: str,
        port: int,
        selector: selectors.BaseSelector,
        say: Say,
        ears: Callable[[], Ear] = deaf,
    ) -> None:
        self.name, self._selector, self._say, self._ears = name, selector, say, ears
        self._clients: dict[socket.socket, bytearray] = {}
        self._is_told, self._deaf_until = False, 0.0
        self._server = socket.create_server((host, port), backlog=WAITING)
        self._server.setblocking(False)
        #: The port that it listens on; of port 0 the one that was free.
        self.port = self._server.getsockname()[1]
        self._listen()

    def _listen(self) -> None:
        self._selector.register(self._server, selectors.EVENT_READ, self._accept)
        self._deaf_until = 0.0

    @property
    def clients(self) -> int:
        return len(self._clients)

    def _accept(self, _: int) -> None:
        try:
            client, _address = self._server.accept()
        except (BlockingIOError, ConnectionError):  # gone again
            return
        except OSError:  # it goes on asking as long as too many files are open
            self._selector.unregister(self._server)
            self._deaf_until = monotonic() + RECOVERY_S
            return
        if self.clients >= MOST_CLIENTS or not leaves_room(client.fileno()):
            client.close()
            if not self._is_told:
                self._say(f"{self.name}: {self.clients} clients are served, more are turned away")
            self._is_told = True
            return
        client.setblocking(False)
        client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._clients[client] = bytearray()
        ear = self._ears()
        self._selector.register(client, selectors.EVENT_READ, lambda mask: self._serve(client, ear))

    def _serve(self, client: socket.socket, ear: Ear) -> None:
        """Hear what a client says, until it goes; send what it had no room for."""
        try:
            if data := client.recv(DISCARDED):
                ear(data)
            else:
                self._drop(client)
        except BlockingIOError:
            pass
        except OSError:
            self._drop(client)
        if client in self._clients:
            self._flush(client)

    def send(self, telegram: bytes) -> None:
        if self._deaf_until and monotonic() > self._deaf_until:
            self._listen()
        for client, waiting in list(self._clients.items()):
            waiting += telegram
            self._flush(client)

    def _flush(self, client: socket.socket) -> None:
        waiting = self._clients[client]
        try:
            while waiting:
                del waiting[: client.send(waiting)]
        except BlockingIOError:
            if len(waiting) > BACKLOG:
                self._say(f"{self.name}: a client that does not read is dropped")
                self._drop(client)
                return
        except OSError:
            self._drop(client)
            return
        events = selectors.EVENT_READ | (selectors.EVENT_WRITE if waiting else 0)
        key = self._selector.get_key(client)
        if key.events != events:
            self._selector.modify(client, events, key.data)

    def _drop(self, client: socket.socket) -> None:
        del self._clients[client]
        self._selector.unregister(client)
        client.close()

    def close(self) -> None:
        for client in list(self._clients):
            self._drop(client)
        if not self._deaf_until:
            self._selector.unregister(self._server)
        self._server.close()


class Terminal:
    """A pseudo-terminal, which others open as they would a serial port; `path` is its name.

    As with a serial line, what nobody reads is lost.
    """

    clients = 0

    def __init__(
        self, name: str, selector: selectors.BaseSelector, ears: Callable[[], Ear] = deaf
    ) -> None:
        self.name, self._selector, self._ear = name, selector, ears()
        self._ours, self._theirs = os.openpty()
        tty.setraw(self._theirs)
        os.set_blocking(self._ours, False)
        self.path = os.ttyname(self._theirs)
        selector.register(self._ours, selectors.EVENT_READ, self._hear)

    def _hear(self, _: int) -> None:
        with suppress(OSError):
            self._ear(os.read(self._ours, DISCARDED))

    def send(self, telegram: bytes) -> None:
        with suppress(BlockingIOError):
            os.write(self._ours, telegram)

    def close(self) -> None:
        self._selector.unregister(self._ours)
        os.close(self._ours)
        os.close(self._theirs)


class File:
    """Writes telegrams to a file that is new, or to a serial port."""

    clients = 0

    def __init__(self, name: str, path: Path, *, replace: bool) -> None:
        self.name = name
        flags = os.O_WRONLY | os.O_CREAT | os.O_APPEND | os.O_NOCTTY | os.O_CLOEXEC
        if not path.is_char_device():
            flags |= os.O_TRUNC if replace else os.O_EXCL
        descriptor = os.open(path, flags | os.O_NONBLOCK, 0o666)
        # Who reads a pipe, as a serial port, may be slow
        os.set_blocking(descriptor, stat.S_ISREG(os.fstat(descriptor).st_mode))
        self._file = os.fdopen(descriptor, "wb", buffering=0)

    def send(self, telegram: bytes) -> None:
        rest = memoryview(telegram)
        while rest:
            written = self._file.write(rest)
            if written is None:  # a serial port or a pipe that is full
                return
            rest = rest[written:]

    def close(self) -> None:
        self._file.close()
