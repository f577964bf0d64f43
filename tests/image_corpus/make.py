#!/usr/bin/env python3
"""Writes the corpus of small image files, tests/image_corpus/files/.

Run it from the repository's root; the same files every time. What each should give is in expected.tsv, which this
script does not know: line by line, someone has to say what is right.
"""
import pathlib
import zlib

OUT = pathlib.Path("tests/image_corpus/files")


def srec(kind, address, data=b"", width=None):
    width = width or {"0": 2, "1": 2, "2": 3, "3": 4, "5": 2, "6": 3, "7": 4, "8": 3, "9": 2}[kind]
    body = address.to_bytes(width, "big") + bytes(data)
    body = bytes([len(body) + 1]) + body
    return "S" + kind + body.hex().upper() + f"{~sum(body) & 255:02X}"


def ihex(kind, offset, data=b""):
    body = bytes([len(data)]) + offset.to_bytes(2, "big") + bytes([kind]) + bytes(data)
    return ":" + body.hex().upper() + f"{-sum(body) & 255:02X}"


def words(first, number):
    """Some words, low byte first, all different."""
    return b"".join((0x1111 + 0x0101 * (first + at) & 0xFFFF).to_bytes(2, "little") for at in range(number))


def write(name, lines, end="\r\n", last=None, front=b""):
    text = end.join(lines) + (end if last is None else last)
    (OUT / name).write_bytes(front + text.encode("latin-1"))


HEAD = srec("0", 0, b"PROGRAM&DATA", 4)
SHORT_HEAD = srec("0", 0, b"HDR")
END = srec("7", 0)
D = [srec("3", at * 8, words(at * 8, 8)) for at in range(4)]  # four records of eight words
B = [srec("3", at * 16, words(at * 8, 8)) for at in range(4)]  # the same at byte addresses
H = [ihex(0, at * 8, words(at * 8, 8)) for at in range(4)]
HB = [ihex(0, at * 16, words(at * 8, 8)) for at in range(4)]
START, EOF = ihex(5, 0, bytes(4)), ihex(1, 0)


def program(product="AXTC4CO", version="1.2.0", mend=lambda block: None):
    """The smallest program with an identity block (docs/images.md), 160 words."""
    data = bytearray(words(0, 160))
    block = bytearray(64)
    block[0:4], block[4], block[6] = b"AXID", 1, 64
    for at, text in ((8, product), (20, version), (32, "2026-01-31"), (42, "12:00:00")):
        block[at:at + len(text)] = text.encode()
    block[52:56] = (160).to_bytes(4, "little")
    block[60:64] = b"\xFF" * 4
    mend(block)
    data[256:320] = block
    data[316:320] = zlib.crc32(data).to_bytes(4, "little")
    return bytes(data)


def lines_of(data, unit=2, size=32):
    starts = range(0, len(data), size)
    return [HEAD, *(srec("3", at // unit, data[at:at + size]) for at in starts), END]


def hex_of(data, unit=2, size=16):
    return [*(ihex(0, at // unit, data[at:at + size]) for at in range(0, len(data), size)), START, EOF]


def changed(data, at):
    return data[:at] + bytes([data[at] ^ 1]) + data[at + 1:]


def swap(line, at, new):
    return line[:at] + new + line[at + len(new):]


def files():
    # Sound ones, all line ends and forms.
    write("ok-crlf.S", [HEAD, *D, END])
    write("ok-cr.S", [HEAD, *D, END], "\r")
    write("ok-lf.S", [HEAD, *D, END], "\n")
    write("ok-one-record.S", [HEAD, D[0], END])
    write("ok-header-empty.S", [srec("0", 0, b"", 4), *D, END])
    write("ok-header-longest.S", [srec("0", 0, b"x" * 250, 4), *D, END])
    write("ok-record-longest.S", [HEAD, srec("3", 0, words(0, 125)), srec("3", 125, words(125, 1)), END])
    write("ok-record-shortest.S", [HEAD, srec("3", 0, words(0, 1)), srec("3", 1, words(1, 1)), END])
    write("ok-sizes-mixed.S", [HEAD, srec("3", 0, words(0, 3)), srec("3", 3, words(3, 16)), srec("3", 19, words(19, 1)), END])
    write("ok-header-any-bytes.S", [srec("0", 0, bytes(range(0x80, 0x90)), 4), *D, END])
    write("ok-entry-inside.S", [HEAD, *D, srec("7", 0x1F)])
    # Line ends, blanks, case.
    write("ends-mixed.S", [HEAD, *D[:2], END], "\r\n", "\n")
    write("ends-mixed-cr-lf.S", [HEAD + "\r" + D[0] + "\n" + D[1] + "\r" + END], "\r")
    write("ends-last-missing.S", [HEAD, *D, END], last="")
    write("ends-last-missing-cr.S", [HEAD, *D, END], "\r", "")
    write("ends-doubled.S", [HEAD, "", D[0], "", END], "\r\n")
    write("ends-lf-cr.S", [HEAD, *D, END], "\n\r")
    write("blanks-behind.S", [HEAD, D[0] + "  ", D[1] + "\t", *D[2:], END])
    write("blanks-before.S", [HEAD, D[0], " " + D[1], *D[2:], END])
    write("blanks-inside.S", [HEAD, D[0][:20] + " " + D[0][20:], *D[1:], END])
    write("blank-lines-at-the-end.S", [HEAD, *D, END, "", "  "])
    write("mark-utf8.S", [HEAD, *D, END], front=b"\xEF\xBB\xBF")
    write("lower-case.S", [HEAD, *[line.lower() for line in D], END])
    write("lower-case-s-only.S", [HEAD, "s" + D[0][1:], *D[1:], END])
    # No image at all.
    (OUT / "empty").write_bytes(b"")
    (OUT / "empty-blanks").write_bytes(b" \r\n\t\n")
    (OUT / "text.txt").write_bytes(b"Dear customer,\r\nthe image follows.\r\n")
    (OUT / "page.html").write_bytes(b"<html><body>404</body></html>\n")
    (OUT / "archive.zip").write_bytes(b"PK\x03\x04" + bytes(40))
    (OUT / "archive.gz").write_bytes(b"\x1F\x8B\x08" + bytes(40))
    (OUT / "program.elf").write_bytes(b"\x7FELF\x01\x01\x01" + bytes(40))
    (OUT / "utf16.S").write_bytes("\r\n".join([HEAD, *D, END]).encode("utf-16"))
    (OUT / "binary.bin").write_bytes(bytes(range(256)))
    # Lines that are no records.
    write("line-junk-first.S", ["; a remark", HEAD, *D, END])
    write("line-junk-inside.S", [HEAD, *D[:2], "login:", *D[2:], END])
    write("line-hex-inside.S", [HEAD, *D[:2], H[2], D[3], END])
    write("line-two-records.S", [HEAD, D[0] + D[1], *D[2:], END])
    write("line-cut.S", [HEAD, D[0], D[1][:21], *D[2:], END])
    write("line-cut-odd.S", [HEAD, D[0], D[1][:20], *D[2:], END])
    write("line-only-s.S", [HEAD, *D[:2], "S", *D[2:], END])
    write("line-only-type.S", [HEAD, *D[:2], "S3", *D[2:], END])
    write("line-nul-inside.S", [HEAD, swap(D[0], 20, "\0"), *D[1:], END])
    write("line-letter-o.S", [HEAD, D[0], swap(D[1], 6, "O"), *D[2:], END])
    write("line-latin1.S", [HEAD, D[0], swap(D[1], 12, "\xE4"), *D[2:], END])
    write("line-bad-length-digit.S", [HEAD, D[0], swap(D[1], 3, "X"), *D[2:], END])
    write("line-escape-sequence.S", [HEAD, "\x1b[2J" + D[0], *D[1:], END])
    (OUT / "line-endless.S").write_bytes((HEAD + "\n").encode() + b"S3" * 700)
    write("type-s4.S", [HEAD, *D[:2], swap(D[2], 1, "4"), D[3], END])
    write("type-letter.S", [HEAD, *D[:2], swap(D[2], 1, "X"), D[3], END])
    write("type-s1-s9.S", [HEAD, srec("1", 0, words(0, 8)), srec("1", 8, words(8, 8)), srec("9", 0)])
    write("type-s2-s8.S", [HEAD, srec("2", 0, words(0, 8)), srec("2", 8, words(8, 8)), srec("8", 0)])
    write("type-s1-longest.S", [HEAD, srec("1", 0, words(0, 126)), srec("1", 126, words(126, 1)), srec("9", 0)])
    write("length-zero.S", [HEAD, "S300FF", *D, END])
    write("length-too-small.S", [HEAD, "S3040000FB", *D, END])
    write("length-too-large.S", [HEAD, D[0], swap(D[1], 2, "FF"), *D[2:], END])
    write("length-one-more.S", [HEAD, D[0], swap(D[1], 2, "16"), *D[2:], END])
    write("length-one-less.S", [HEAD, D[0], swap(D[1], 2, "14"), *D[2:], END])
    write("length-terminator.S", [HEAD, *D, "S706000000FF00FA"])
    write("checksum-data.S", [HEAD, *D[:2], swap(D[2], len(D[2]) - 1, "0" if D[2][-1] != "0" else "1"), D[3], END])
    write("checksum-header.S", [swap(HEAD, len(HEAD) - 2, "00"), *D, END])
    write("checksum-terminator.S", [HEAD, *D, swap(END, len(END) - 2, "00")])
    write("checksum-two.S", [HEAD, swap(D[0], len(D[0]) - 2, "00"), D[1], swap(D[2], len(D[2]) - 2, "00"), D[3], END])
    write("checksum-bits-cancel.S", [HEAD, srec("3", 0, bytes([0x22, 0x11]) + words(1, 7)), *D[1:], END])
    # Order.
    write("header-missing.S", [*D, END])
    write("header-short-address.S", [SHORT_HEAD, *D, END])
    write("header-usual-empty.S", ["S0030000FC", *D, END])
    write("header-address.S", [srec("0", 0x1234, b"\0\0HDR"), *D, END])
    write("header-late.S", [D[0], HEAD, *D[1:], END])
    write("header-last.S", [*D, HEAD, END])
    write("header-twice.S", [HEAD, HEAD, *D, END])
    write("header-damaged.S", [swap(HEAD, 8, "G"), *D, END])
    write("terminator-missing.S", [HEAD, *D])
    write("terminator-twice.S", [HEAD, *D, END, END])
    write("terminator-first.S", [END, HEAD, *D])
    write("terminator-damaged.S", [HEAD, *D, swap(END, 8, "G")])
    write("terminator-then-data.S", [HEAD, *D[:3], END, D[3]])
    write("files-joined.S", [HEAD, *D, END, HEAD, *D, END])
    write("count-right.S", [HEAD, *D, srec("5", 4), END])
    write("count-right-s6.S", [HEAD, *D, srec("6", 4), END])
    write("count-wrong.S", [HEAD, *D, srec("5", 5), END])
    write("count-record-missing.S", [HEAD, *D[:2], D[3], srec("5", 4), END])
    write("data-none.S", [HEAD, END])
    write("data-empty-record.S", [HEAD, D[0], srec("3", 8), *D[1:], END])
    write("data-odd.S", [HEAD, *D[:3], srec("3", 24, words(24, 8)[:-1]), END])
    # Addresses.
    write("address-descending.S", [HEAD, D[1], D[0], *D[2:], END])
    write("address-same-twice.S", [HEAD, D[0], D[0], *D[1:], END])
    write("address-overlap-one-word.S", [HEAD, D[0], srec("3", 7, words(7, 9)), *D[2:], END])
    write("address-gap.S", [HEAD, *D[:2], D[3], END])
    write("address-gap-in-front.S", [HEAD, *D[1:], srec("7", 8)])
    write("address-bytes.S", [HEAD, *B, END])
    write("address-wrap.S", [HEAD, *D, srec("3", 0xFFFFFFFC, words(0, 8)), END])
    write("address-beyond-largest.S", [HEAD, *D, srec("3", 0x40000, words(0, 8)), END])
    outside = [srec("3", at, words(0, 8)) for at in (0x40000, 0x40008, 0x50000)]
    write("address-beyond-largest-twice.S", [HEAD, *D, *outside, END])
    write("address-crosses-the-end.S", [HEAD, *D, srec("3", 0x3FFFC, words(0, 8)), END])
    write("address-data-memory.S", [HEAD, *D, srec("3", 0x02000000, words(0, 8)), END])
    write("address-data-memory-0020.S", [HEAD, *D, srec("3", 0x00200000, words(0, 8)), END])
    write("AXTC4CO_V1.2.0.boot-flash.S", [HEAD, *D, srec("3", 0x20000, words(0, 8)), END])
    write("AXTC4CO_V1.2.0.folded.S", [HEAD, *D, srec("3", 0x10000, words(0, 8)), END])
    write("AXRTD8CO_V2.2.0.boot-flash.S", [HEAD, *D, srec("3", 0x40000, words(0, 8)), END])
    write("entry-outside.S", [HEAD, *D, srec("7", 0x100)])
    # Intel HEX.
    write("ok-crlf.hex", [*H, START, EOF])
    write("ok-cr.hex", [*H, START, EOF], "\r")
    write("ok-lf.hex", [*H, START, EOF], "\n")
    write("ok-lower-case.hex", [line.lower() for line in [*H, START, EOF]])
    write("ok-named-like-s-records.S", [*H, START, EOF])
    write("ok-linear-base.hex", [ihex(4, 0, bytes(2)), *H, START, EOF])
    write("ok-segment-base.hex", [ihex(2, 0, bytes([0, 0])), *H[:2], ihex(2, 0, bytes([0, 1])), ihex(0, 0, words(16, 8)), START, EOF])
    write("ok-segment-start.hex", [*H, ihex(3, 0, bytes([0, 1, 0, 2])), EOF])
    write("ok-start-first.hex", [START, *H, EOF])
    write("ok-longest.hex", [ihex(0, 0, words(0, 127)), ihex(0, 127, words(127, 1)), START, EOF])
    write("entry-missing.hex", [*H, EOF])
    write("entry-twice.hex", [*H, START, START, EOF])
    write("entry-outside.hex", [*H, ihex(5, 0, bytes([0, 0, 1, 0])), EOF])
    write("offset-of-eof.hex", [*H, START, ihex(1, 0x0100)])
    write("eof-missing.hex", [*H, START])
    write("eof-twice.hex", [*H, START, EOF, EOF])
    write("eof-then-data.hex", [*H[:3], START, EOF, H[3]])
    write("eof-damaged.hex", [*H, START, ":0000000GFF"])
    write("eof-with-data.hex", [*H, START, ":0100000100FE"])
    write("checksum.hex", [H[0], swap(H[1], len(H[1]) - 2, "00"), *H[2:], START, EOF])
    write("type-06.hex", [*H, ihex(6, 0), START, EOF])
    write("length-short-line.hex", [H[0], H[1][:-3], *H[2:], START, EOF])
    write("length-of-base.hex", [":0100000400FB", *H, START, EOF])
    write("trailing.hex", [H[0], H[1] + ":", *H[2:], START, EOF])
    write("trailing-blanks.hex", [H[0], H[1] + " ", *H[2:], START, EOF])
    write("letter-o.hex", [H[0], swap(H[1], 9, "O"), *H[2:], START, EOF])
    write("base-damaged.hex", [swap(ihex(4, 0, bytes(2)), 9, "G"), *H, START, EOF])
    write("s-record-inside.hex", [*H[:2], D[2], H[3], START, EOF])
    write("remark-inside.hex", [*H[:2], "; a remark", *H[2:], START, EOF])
    write("overlap.hex", [H[0], H[0], *H[1:], START, EOF])
    write("bytes.hex", [*HB, START, EOF])
    write("odd.hex", [*H[:3], ihex(0, 24, words(24, 8)[:-1]), START, EOF])
    write("wrap-64k.hex", [*H, ihex(0, 0xFFFC, words(0, 8)), START, EOF])
    write("wrap-64k-bytes.hex", [*HB, ihex(0, 0xFFF8, words(0, 8)), START, EOF])
    write("wrap-all.hex", [*H, ihex(4, 0, b"\xFF\xFF"), ihex(0, 0xFFFC, words(0, 8)), START, EOF])
    write("data-none.hex", [START, EOF])
    write("mark-utf8.hex", [*H, START, EOF], front=b"\xEF\xBB\xBF")
    write("blank-line.hex", [H[0], "", *H[1:], START, EOF])
    write("beyond-largest.hex", [*H, ihex(4, 0, bytes([0, 4])), ihex(0, 0, words(0, 8)), START, EOF])
    # Identity.
    write("AXTC4CO_V1.2.0.elf.S", lines_of(program()))
    write("AXTC4CO_V1.2.0.hex", hex_of(program()))
    write("axtc4co_v1.2.0 (1).elf.s", lines_of(program()))
    write("AXTC4CO_V1.2.0.odd-sizes.S", lines_of(program(), size=26))
    write("AXTC4CO_V1.2.1.other-version.S", lines_of(program()))
    write("AXRTD8CO_V2.2.0.other-product.S", lines_of(program()))
    write("AXTC4CO_V1.2.0.bytes.S", lines_of(program(), unit=1))
    write("AXTC4CO_V1.2.0.bytes.hex", hex_of(program(), unit=1))
    write("identity-named-otherwise.S", lines_of(program("AXRTD8CO", "2.2.0")))
    write("identity-unknown-product.S", lines_of(program("AX999999")))
    write("identity-no-version.S", lines_of(program(version="new")))
    write("identity-no-product.S", lines_of(program("")))
    write("identity-format-2.S", lines_of(program(mend=lambda block: block.__setitem__(4, 2))))
    write("identity-too-long.S", lines_of(program(mend=lambda block: block.__setitem__(53, 1))))
    write("identity-escape.S", lines_of(program("AX\x1b[2J")))
    write("identity-crc.S", lines_of(changed(program(), 20)))
    write("identity-crc.hex", hex_of(changed(program(), 20)))
    write("identity-record-lost.S", (lambda all: all[:3] + all[4:])(lines_of(program())))
    write("identity-records-exchanged.S", (lambda all: all[:3] + [all[4], all[3]] + all[5:])(lines_of(program())))


if __name__ == "__main__":
    OUT.mkdir(exist_ok=True)
    files()
