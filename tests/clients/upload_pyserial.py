#!/usr/bin/env python3
"""Uploads an S-record file to a unit the way the manual's terminal program does.

A second opinion on the emulator: nothing here is shared with axcon, and the operating system does XON/XOFF, as in
Tera Term or HyperTerminal. Needs pyserial.

    upload_pyserial.py PORT FILE VERSION [--password TEXT] [--key-at-loader] [--deaf] [--line-feeds]

--deaf sends without flow control, --line-feeds ends lines with CR LF: the mistakes of real terminals.

Exit code 0 if the unit starts with VERSION, 3 with what was heard instead if it does not, 1 if anything else goes wrong.
"""

import argparse
import re
import sys
import time

import serial

LOADER_PROMPT = b"Waiting for application S-Record"
PASSWORD_PROMPT = re.compile(rb"password[^\r\n]*$", re.IGNORECASE)

# Longest waits, in seconds. A prompt comes at once; a reset erases nothing; an upload of the largest file takes 25 s
# on the line alone, and the unit programs its flash meanwhile.
PROMPT_WAIT = 10
LOADER_WAIT = 20
UPLOAD_WAIT = 180
BANNER_WAIT = 30


class Failed(Exception):
    """What did not happen, and what was heard instead."""


class Unit:
    def __init__(self, port, deaf):
        self.port = serial.Serial(port, 115200, xonxoff=not deaf, timeout=0.05, write_timeout=UPLOAD_WAIT, exclusive=True)
        self.heard = b""

    def wait(self, what, found, seconds):
        """Reads until `found` is true of all that was heard since the last wait, and forgets it."""
        end = time.monotonic() + seconds
        while not found(self.heard):
            if time.monotonic() > end:
                raise Failed(f"no {what} within {seconds} s; heard {self.heard[-300:]!r}")
            self.heard += self.port.read(4096)
        heard, self.heard = self.heard, b""
        return heard

    def drain(self, seconds):
        """Takes what the unit says for a while."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            self.heard += self.port.read(4096)
        heard, self.heard = self.heard, b""
        return heard


def upload(arguments):
    with open(arguments.file, "rb") as file:
        # The manual's terminal sends CR at the end of a line, whatever the file has.
        lines = [line.strip() for line in re.split(rb"\r\n|\r|\n", file.read()) if line.strip()]
    if not lines or not all(line[:1] in (b"S", b"s") for line in lines):
        raise Failed(f"{arguments.file} is not an S-record file")

    unit = Unit(arguments.port, arguments.deaf)
    line_end = b"\r\n" if arguments.line_feeds else b"\r"
    unit.drain(0.3)
    unit.port.write(b"l")
    unit.wait("password prompt", lambda heard: PASSWORD_PROMPT.search(heard.rstrip()), PROMPT_WAIT)
    unit.port.write(arguments.password.encode() + b"\r")
    if arguments.key_at_loader:
        unit.wait("bootloader header", lambda heard: b"key" in heard.lower(), LOADER_WAIT)
        unit.port.write(b" ")
    unit.wait("loader prompt", lambda heard: LOADER_PROMPT in heard, LOADER_WAIT)

    begun = time.monotonic()
    count = sum(len(line) + 1 for line in lines)
    for line in lines:
        unit.port.write(line + line_end)
        # What the unit says meanwhile is kept: the banner may come while the last records are still in the driver.
        unit.heard += unit.port.read(unit.port.in_waiting)
    wanted = re.compile(rb"V?" + re.escape(arguments.version.lstrip("Vv").encode()) + rb"(?![0-9.])", re.IGNORECASE)
    banner = unit.wait(
        f"banner with version {arguments.version}", lambda heard: wanted.search(heard), arguments.patience
    )
    seconds = time.monotonic() - begun
    print(f"{len(lines)} records, {count} characters in {seconds:.1f} s; heard {banner[-200:]!r}")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("port")
    parser.add_argument("file")
    parser.add_argument("version", help="what the new banner has to say, e.g. 1.2.0")
    parser.add_argument("--password", default="AXIO-2010", help="what emulated units take, unless given")
    parser.add_argument("--key-at-loader", action="store_true", help="the loader wants a key before it listens")
    parser.add_argument("--deaf", action="store_true", help="without flow control")
    parser.add_argument("--line-feeds", action="store_true", help="CR LF behind each record")
    parser.add_argument("--patience", type=float, default=UPLOAD_WAIT + BANNER_WAIT, help="seconds for the banner")
    arguments = parser.parse_args()
    try:
        upload(arguments)
    except (Failed, OSError, serial.SerialException) as error:
        print(f"upload failed: {error}", file=sys.stderr)
        return 3 if isinstance(error, Failed) else 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
