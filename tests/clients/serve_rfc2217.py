#!/usr/bin/env python3
"""Serves a serial port by RFC 2217, with the server half of pyserial.

A second opinion on the network link: nothing here is shared with axcon. Needs pyserial.

    serve_rfc2217.py PORT

Listens on a free port of 127.0.0.1 and prints its number, then serves one client after another until it is killed.
What each client has set when it leaves is printed: baud, data bits, parity, stop bits, flow control.
"""

import socket
import sys
import threading

import serial
import serial.rfc2217

# How often the line is looked at for the end of the connection, in seconds.
READ_WAIT = 0.05


class Port(serial.Serial):
    """A port whose modem lines can be asked for even where there are none, as on a pseudo-terminal."""

    cts = dsr = ri = cd = property(lambda self: False)


class Connection:
    """What the server half writes to; from two threads."""

    def __init__(self, client):
        self.client = client
        self.lock = threading.Lock()

    def write(self, data):
        with self.lock:
            self.client.sendall(data)


def serve(port, client):
    connection = Connection(client)
    manager = serial.rfc2217.PortManager(port, connection)
    over = threading.Event()

    def carry_to_client():
        while not over.is_set():
            data = port.read(port.in_waiting or 1)
            if data:
                try:
                    connection.write(b"".join(manager.escape(data)))
                except OSError:
                    return

    carrier = threading.Thread(target=carry_to_client)
    carrier.start()
    try:
        while True:
            data = client.recv(4096)
            if not data:
                break
            port.write(b"".join(manager.filter(data)))
    except OSError:
        pass
    finally:
        over.set()
        carrier.join()
        client.close()


def main():
    # What every client has to change.
    port = Port(sys.argv[1], 9600, xonxoff=True, timeout=READ_WAIT)
    listener = socket.create_server(("127.0.0.1", 0))
    print(listener.getsockname()[1], flush=True)
    while True:
        client, _ = listener.accept()
        client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        serve(port, client)
        flow = "xonxoff" if port.xonxoff else "none"
        print(f"left: {port.baudrate} {port.bytesize} {port.parity} {port.stopbits} {flow}", flush=True)


if __name__ == "__main__":
    sys.exit(main())
