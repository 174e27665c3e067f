"""Mutations of files: of their bytes, of numbers and lines in their text, of their JSON."""

import json
import re

HEAD = 1500  # most mutations are made in the first bytes, where headers are

WHOLE = [0, 1, 2, 3, 7, 127, 128, 255, 256, 32767, 65535, 2**31 - 1, 2**31, 2**32 - 1, 2**63 - 1]
TEXTS = [
    "-1", "0", "1e308", "1e-320", "nan", "inf", "9" * 30, "9" * 5000, "1.5", "x", "", "2147483648",
]  # fmt: skip
VALUES = [
    None, True, False, 0, -1, 1, 2**31, 2**63, 10**9, 10**400, 0.5, -1.5, 1e308, 1e-320,
    float("nan"), float("inf"), "", "x", "../../x", "\udce9", "9" * 5000, [], {}, [1, 2], [[]],
    {"a": 1},
]  # fmt: skip


def mutated(content, rng):
    """Return a file's content with one to four mutations of its bytes or text."""
    for _ in range(rng.choice([1, 1, 1, 2, 4])):
        content = rng.choice(_MUTATIONS)(content, rng)
    return content


def mutated_json(content, rng):
    """Return JSON in which one or two values are others, missing or nested; or mutated bytes."""
    if rng.random() < 0.2:
        return mutated(content, rng)
    if rng.random() < 0.02:
        return rng.choice([b"[", b'{"a":']) * 200_000
    data = json.loads(content)
    for _ in range(rng.choice([1, 1, 2])):
        data = _changed(data, rng)
    return json.dumps(data).encode()


def _changed(data, rng):
    """Change one value somewhere below."""
    if not isinstance(data, dict | list) or not data or rng.random() < 0.1:
        return rng.choice(VALUES)
    key = rng.choice(list(data) if isinstance(data, dict) else range(len(data)))
    chance = rng.random()
    if chance < 0.08:
        del data[key]
    elif chance < 0.12 and isinstance(data, list):
        data *= rng.choice([0, 2, 1000])
    else:
        data[key] = _changed(data[key], rng)
    return data


def _place(content, rng):
    most = len(content) if rng.random() < 0.3 else min(len(content), HEAD)
    return rng.randrange(max(most, 1))


def _flip(content, rng):
    changed = bytearray(content or b"\0")
    changed[_place(content, rng)] ^= 1 << rng.randrange(8)
    return bytes(changed)


def _overwrite(content, rng):
    place, width = _place(content, rng), rng.choice([1, 2, 4, 8])
    value = rng.choice(WHOLE) % (1 << 8 * width)
    number = value.to_bytes(width, rng.choice(["little", "big"]))
    return content[:place] + number + content[place + width :]


def _truncate(content, rng):
    return content[: rng.randrange(len(content) + 1)]


def _delete(content, rng):
    place = _place(content, rng)
    return content[:place] + content[place + rng.choice([1, 2, 16, 200]) :]


def _repeat(content, rng):
    place, length = _place(content, rng), rng.choice([1, 4, 40, 400])
    return content[: place + length] + content[place:]


def _number(content, rng):
    found = list(re.finditer(rb"-?\d+(\.\d+)?", content[:HEAD]))
    if not found:
        return _flip(content, rng)
    match = rng.choice(found)
    return content[: match.start()] + rng.choice(TEXTS).encode() + content[match.end() :]


def _line(content, rng):
    lines = content.split(b"\n")
    index = rng.randrange(min(len(lines), 30))
    other = rng.randrange(min(len(lines), 30))
    change = rng.randrange(3)
    if change == 0:
        lines.insert(other, lines[index])
    elif change == 1:
        del lines[index]
    else:
        lines[index], lines[other] = lines[other], lines[index]
    return b"\n".join(lines)


_MUTATIONS = (_flip, _flip, _overwrite, _overwrite, _truncate, _delete, _repeat, _number, _line)
