"""Values and damage that a user, a program or a disk can leave in a file."""

import copy
from xml.etree import ElementTree

import numpy as np
import yaml

ODD_NUMBERS = (
    0, -0.0, 1, -1, 2, 0.1, 1e-9, -1e-9, 1e-300, 5e-324, 1e9, -1e9, 1e18, 1e300, -1e300, float('inf'), float('-inf'),
    float('nan'), 255, 256, 65536, 2**31 - 1, 2**31, -(2**31), 2**53 + 1, 2**63, -(2**63), 2**64, 10**400,
)  # fmt: skip
ODD_VALUES = (
    *ODD_NUMBERS, None, True, False, '', ' ', 'nan', '1e3', '0x10', '1:30', 'text', 'x' * 5000, 'a\nb', 'a\x00b', 'ä€',
    '\x1b[31m', '../../etc/passwd', '/dev/zero', '/', '.', [], {}, [1, 2], [[]], {'x': 1}, {1: 2}, {'x': {'y': []}},
)  # fmt: skip
ODD_WORDS = ('', 'text', 'nan', '1e400', '-1', 'x' * 5000, 'ä€', 'package://nobody/a.stl', '/dev/zero')
LARGEST_NEAR = 1e300  # of which no factor makes more than a float holds
FACTORS = (0.5, 0.9, 1.1, 2.0, 3.0, 10.0, -1.0, 1e-3, 1e3)


def pick(rng, choices):
    """Return one of the choices as it is: numpy's own choice makes them into one type."""
    return choices[int(rng.integers(len(choices)))]


def odd_number(rng, near=1.0):
    """Return a number that is odd, or, as often, one in the neighbourhood of a good one."""
    is_odd = rng.random() < 0.4 or not abs(near) < LARGEST_NEAR
    return pick(rng, ODD_NUMBERS) if is_odd else near * pick(rng, FACTORS)


def odd_float(rng, near=1.0):
    """Return the same as a float: messages have no others."""
    value = odd_number(rng, near)
    return float('inf') if isinstance(value, int) and abs(value) > 1e308 else float(value)


def odd_value(rng, good):
    """Return another value in place of a good one: most often one of its type, which gets past the first check."""
    if isinstance(good, bool):
        return not good if rng.random() < 0.7 else pick(rng, ODD_VALUES)
    if isinstance(good, (int, float)) and rng.random() < 0.9:
        value = odd_number(rng, good or 1)
        return int(value) if isinstance(good, int) and abs(value) < 1e18 else value
    return pick(rng, ODD_VALUES)


def odd_mapping(rng, good, changes=2):
    """Return a mapping as YAML gives it, with a few values, keys and parts changed."""
    mapping = copy.deepcopy(good)
    for _ in range(int(rng.integers(1, changes + 1))):
        places = list(_places(mapping))
        if not places:
            break
        parent, key = pick(rng, places)
        action = rng.random()
        if action < 0.85:
            parent[key] = odd_value(rng, parent[key])
        elif action < 0.92:
            del parent[key]
        elif isinstance(parent, dict):
            parent[pick(rng, ('unknown', '', 'x' * 300, 1, None, f'{key}s'))] = parent[key]
        else:
            parent.append(parent[key])
    return mapping


def _places(part):
    """Yield (container, key) of every value, at any depth."""
    for key in list(part) if isinstance(part, dict) else range(len(part)):
        yield part, key
        if isinstance(part[key], (dict, list)):
            yield from _places(part[key])


def write_yaml(rng, path, mapping):
    """Write a mapping, once in a while with damage to its text."""
    text = yaml.safe_dump(mapping, sort_keys=False, allow_unicode=True)
    path.write_bytes(damaged(rng, text.encode('utf-8', 'replace')) if rng.random() < 0.05 else text.encode())
    return path


def damaged(rng, content):
    """Return bytes with a few of them changed, left out, doubled or cut off."""
    content = bytearray(content)
    for _ in range(int(rng.integers(1, 4))):
        at = int(rng.integers(len(content) + 1))
        part = slice(at, at + int(rng.integers(1, 20)))
        noise = bytes(rng.integers(0, 256, int(rng.integers(1, 20)), dtype=np.uint8))
        content[part] = pick(rng, (noise[:1], b'', content[part] * 2, noise + content[part]))
        if rng.random() < 0.06:
            del content[at:]
    return bytes(content)


def odd_xml(rng, text, changes=3):
    """Return an XML text with a few elements, attributes and numbers changed, once in a while with damage."""
    root = ElementTree.fromstring(text)
    for _ in range(int(rng.integers(1, changes + 1))):
        _change_element(rng, root)
    changed = ElementTree.tostring(root, encoding='unicode')
    return damaged(rng, changed.encode()) if rng.random() < 0.15 else changed.encode('utf-8', 'replace')


def _change_element(rng, root):
    parents = [(parent, element) for parent in root.iter() for element in parent]
    if not parents:
        return
    parent, element = pick(rng, parents)
    action = rng.random()
    if action < 0.6:  # a word of an attribute or of the text
        if element.attrib and (rng.random() < 0.7 or not (element.text or '').strip()):
            key = pick(rng, sorted(element.attrib))
            element.set(key, _odd_words(rng, element.get(key)))
        else:
            element.text = _odd_words(rng, element.text or '')
    elif action < 0.75:
        parent.remove(element)
    elif action < 0.92:
        pick(rng, (parent, *root.iter())).append(copy.deepcopy(element))
    else:
        element.tag = pick(rng, ('unknown', 'link', 'pose', 'size', 'origin', 'geometry', 'mesh', 'include'))


def _odd_words(rng, text):
    words = text.split() or ['']
    index = int(rng.integers(len(words)))
    try:
        words[index] = str(odd_number(rng, float(words[index])))
    except ValueError:
        words[index] = pick(rng, ODD_WORDS)
    if rng.random() < 0.1:
        words.append(words[index])
    return ' '.join(words)
