"""Text and bytes with something wrong in them."""

from random import Random

from .values import BOMB, YAML

# What is put between the bytes of a text
ODD = (
    b"\0", b"\xff", b"\xfe\xff", b"\xef\xbb\xbf", b"\r", b"\t", b"\x1b[31m", b"\xc3",
    b"\xed\xa0\x80", b"\n\n", b"'", b'"', b",", b":", b"{", b"]", b"&a ", b"*a",
    b"\xe2\x80\xa8", b"1e999",
)  # fmt: skip


def lines_mutated(text: str, draw: Random) -> str:
    """Return a text with one of its lines changed, or what is around them."""
    lines = text.split("\n")
    where = draw.randrange(len(lines))
    how = draw.randrange(9)
    if how == 0:
        lines.insert(where, draw.choice(lines))
    elif how == 1:
        del lines[where]
    elif how == 2:
        lines[where] = draw.choice((" ", "  ", "\t", "- ", "? ", ": ")) + lines[where]
    elif how == 3:
        lines[where] = lines[where].lstrip()
    elif how == 4:
        lines.insert(where, draw.choice(("---", "...", "%YAML 1.1", "%TAG ! !!", BOMB)))
    elif how == 5:
        lines.insert(where, draw.choice(YAML))
    elif how == 6:
        lines[where] = lines[where].replace(":", draw.choice((":" * 9, ": &a", ": *a", "=", " :")))
    elif how == 7:
        lines *= draw.choice((2, 2, 20))
    else:
        lines[where] += draw.choice(
            (" # é", " #", ":", " !", " &a", "\t", " |", " >", "\x85", "\u2028")
        )
    return draw.choice(("\n", "\n", "\n", "\r\n", "\r")).join(lines)


def encoded(text: str, draw: Random) -> bytes:
    """Return a text as UTF-8, now and then with a mark before it or in another encoding."""
    how = draw.random()
    if how < 0.94:
        return text.encode(errors="surrogatepass")
    codec = draw.choice(("utf-8-sig", "utf-16", "utf-32-le", "latin-1", "cp037"))
    return text.encode(codec, errors="replace")


def bytes_mutated(raw: bytes, draw: Random) -> bytes:
    """Return bytes flipped, cut, doubled, with others put in, or none at all."""
    how = draw.randrange(7)
    at, end = sorted(draw.randrange(len(raw) + 1) for _ in range(2))
    if how == 0 and raw:
        out = bytearray(raw)
        for _ in range(draw.choice((1, 1, 3, 30))):
            out[draw.randrange(len(out))] ^= 1 << draw.randrange(8)
        return bytes(out)
    if how == 1:
        return raw[:at]
    if how == 2:
        return raw[:at] + raw[min(end, at + 40) :]
    if how == 3:
        return raw[:at] + draw.choice(ODD) + raw[at:]
    if how == 4:
        return raw[:at] + draw.randbytes(draw.choice((1, 8, 100))) + raw[at:]
    if how == 5:
        return raw + raw[at:]
    return draw.choice((b"", b"\0" * len(raw), b"\n", raw[at:], b"{}", b"[]", b"null"))
