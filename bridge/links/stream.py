"""A link over a byte stream that may be slow or vanish: one thread owns the port, the loop never waits for it."""

from __future__ import annotations

import os
import select
import threading
from collections import deque
from collections.abc import Callable
from typing import Protocol

from bridge.links.ledger import Ledger
from bridge.links.mailbox import Mailbox, Posted
from bridge.wire import LinkState, Message, Sent

RETRY_S = 1.0
_FLUSH_S = 0.5  # how long `close` lets the last messages leave, and then again lets the thread end
_STALL_S = 1.0  # longer than any message takes at 57600 baud, shorter than a flight goes wrong
_INBOX_CHUNKS = 256


class Port(Protocol):
    """An open serial port or socket, made by calling its class. Every method may raise OSError, `discard` apart.

    low_water_bytes: the next message may be written while the kernel holds no more than this.
    poll_s: how long to wait before `pending` is asked again [s].
    """

    low_water_bytes: int
    poll_s: float

    def fileno(self) -> int:
        """Return the descriptor that gets readable when bytes come in or the far end goes."""

    def write(self, data: bytes) -> None:
        """Hand all of `data` to the kernel, or raise within a second or so."""

    def read(self) -> bytes:
        """Return what came in, at least a byte; only called once `fileno` is readable."""

    def pending(self) -> int:
        """Return how many written bytes the kernel still holds."""

    def close(self) -> None:
        """Close the port."""

    def discard(self) -> None:
        """Close the port at once, whatever it still holds."""


class StreamLink:
    """Send the newest messages through a port as fast as it drains.

    At most `low_water_bytes` and one message lie in the kernel, so what leaves is never older than one message's
    time on the wire. When the port fails, what waits is thrown away and the port is opened again every `retry_s`.

    Args:
        port: the open port.  open_port: opens it again, raising OSError.  ledger: the link's books.
    """

    def __init__(self, port: Port, open_port: Callable[[], Port], ledger: Ledger, retry_s: float = RETRY_S) -> None:
        self.name = ledger.name
        self._open_port = open_port
        self._ledger = ledger
        self._retry_s = retry_s
        self._mailbox = Mailbox()
        self._inbox: deque[bytes] = deque(maxlen=_INBOX_CHUNKS)
        self._heard: Callable[[bytes], None] | None = None
        self._finishing = threading.Event()  # send what waits, then end
        self._quitting = threading.Event()  # end now
        self._closed = False
        self._wake_read, self._wake_write = os.pipe()
        os.set_blocking(self._wake_read, False)
        os.set_blocking(self._wake_write, False)
        self._thread = threading.Thread(target=self._run, args=(port,), name=self.name, daemon=True)
        self._thread.start()

    def send(self, message: Message) -> None:
        """Leave the message for the thread; it replaces an older one of its name."""
        posted = self._mailbox.put(message)
        if posted is Posted.REFUSED:
            self._ledger.dropped()
            if self._closed:
                self._ledger.down("closed")
            return
        if posted is Posted.REPLACED_OLDER:
            self._ledger.superseded()
        self._wake()

    def sent(self) -> list[Sent]:
        """Return what has left since the last call."""
        return self._ledger.collect()

    def receive(self) -> bytes:
        """Return the bytes that came in since the last call."""
        return b"".join(self._inbox.popleft() for _ in range(len(self._inbox)))

    def listen(self, heard: Callable[[bytes], None]) -> None:
        """Give what comes in from now on to `heard`, from the link's thread, as it comes."""
        self._heard = heard

    def replaced(self) -> int:
        """Return how many messages a newer one has replaced so far."""
        return self._ledger.replaced()

    def state(self) -> LinkState:
        """Return how the link fares."""
        return self._ledger.state()

    def close(self) -> None:
        """Let what waits leave for at most half a second, then end the thread and let go of the port."""
        if self._closed:
            return
        self._closed = True
        self._finishing.set()
        self._wake()
        self._thread.join(_FLUSH_S)
        self._quitting.set()
        self._wake()
        self._thread.join(_FLUSH_S)
        self._ledger.dropped(self._mailbox.shut())
        # A thread that hangs in the kernel keeps its pipe: a descriptor closed here could be somebody else's by then.
        if not self._thread.is_alive():
            os.close(self._wake_read)
            os.close(self._wake_write)

    def _wake(self) -> None:
        try:
            os.write(self._wake_write, b"\0")
        except BlockingIOError:  # a full pipe wakes as well
            return

    def _run(self, port: Port | None) -> None:
        while port is not None:
            try:
                self._serve(port)
                return
            except OSError as error:
                self._ledger.dropped(self._mailbox.shut())
                self._ledger.failed(error)
                port.discard()
            port = self._reopen()

    def _reopen(self) -> Port | None:
        """Try to open the port again and again; None once the link is being closed."""
        while not self._finishing.wait(self._retry_s):
            try:
                port = self._open_port()
            except OSError as error:
                self._ledger.failed(error)
                continue
            if self._finishing.is_set():
                port.discard()
                return None
            self._mailbox.open()
            self._ledger.up()
            return port
        return None

    def _serve(self, port: Port) -> None:
        """Write and read until the link is being closed, then close the port."""
        stalled_s = 0.0
        while not self._quitting.is_set():
            pending = port.pending() if self._mailbox or self._finishing.is_set() else 0
            if self._mailbox and pending <= port.low_water_bytes:
                self._write(port)
                stalled_s = 0.0
            elif pending:
                if stalled_s > _STALL_S:
                    raise TimeoutError(f"{pending} bytes do not leave the port; is flow control on?")
                self._quitting.wait(port.poll_s)
                stalled_s += port.poll_s
            elif self._finishing.is_set():
                port.close()
                return
            self._read(port)
        port.discard()

    def _write(self, port: Port) -> None:
        message = self._mailbox.take()
        if message is None:
            return
        raw = self._ledger.frame(message)
        try:
            port.write(raw)
        except OSError:
            self._ledger.dropped()
            raise
        self._ledger.took(message, raw)

    def _read(self, port: Port) -> None:
        """Take in what came; with nothing to write, wait for bytes or for a message."""
        idle = not self._mailbox and not self._finishing.is_set()
        readable, _, _ = select.select([port.fileno(), self._wake_read], [], [], None if idle else 0.0)
        if self._wake_read in readable:
            os.read(self._wake_read, 4096)
        if port.fileno() in readable:
            self._inbox.append(port.read())
            if self._heard is not None:
                self._heard(self.receive())
