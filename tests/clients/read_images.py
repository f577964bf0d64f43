#!/usr/bin/env python3
"""Reads image files with bincopy and with srec_cat and prints what they understood, as JSON.

A second and a third opinion on the reader: nothing here is shared with axcon. Needs the package bincopy, or the program
srec_cat (Debian package srecord), or both; a reader that is not there is left out.

    read_images.py FILE...

One object for each file, in order: for each reader either {"error": "..."} or {"bytes": {"address": "hex", ...}}, with
byte addresses as the reader counts them and runs of bytes joined.
"""

import json
import shutil
import subprocess
import sys

try:
    import bincopy
except ImportError:
    bincopy = None


def runs(pieces: list[tuple[int, bytes]]) -> dict[str, str]:
    """Runs of bytes in memory; of two for one address the later one."""
    memory = {}
    for address, data in pieces:
        memory.update({address + at: byte for at, byte in enumerate(data)})
    found, start, last = {}, None, None
    for address in sorted(memory):
        if address - 1 != last:
            start = str(address)
            found[start] = bytearray()
        found[start].append(memory[address])
        last = address
    return {start: data.hex() for start, data in found.items()}


def with_bincopy(path: str) -> dict:
    file = bincopy.BinFile()
    try:
        file.add_file(path, overwrite=True)
    except Exception as error:  # whatever it raises is its way to refuse
        return {"error": f"{type(error).__name__}: {error}"[:200]}
    return {"bytes": runs([(segment.address, bytes(segment.data)) for segment in file.segments])}


def with_srec_cat(path: str) -> dict:
    text = open(path, "rb").read().lstrip(b"\xef\xbb\xbf \t\r\n")
    kind = "-intel" if text.startswith(b":") else "-motorola"
    command = ["srec_cat", path, kind, "-multiple", "-o", "-", "-motorola", "-address-length=4"]
    done = subprocess.run(command, capture_output=True, check=False, timeout=60)
    if done.returncode != 0:
        return {"error": done.stderr.decode("latin-1")[:200]}
    lines = done.stdout.decode("ascii").split()
    return {"bytes": runs([(int(line[4:12], 16), bytes.fromhex(line[12:-2])) for line in lines if line.startswith("S3")])}


def main() -> int:
    readers = {}
    if bincopy is not None:
        readers["bincopy"] = with_bincopy
    if shutil.which("srec_cat"):
        readers["srec_cat"] = with_srec_cat
    json.dump([{name: read(path) for name, read in readers.items()} for path in sys.argv[1:]], sys.stdout)
    return 0


if __name__ == "__main__":
    sys.exit(main())
