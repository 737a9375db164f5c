"""The commands in README.md, CONTRIBUTING.md and docs/: which there are, which are run, and what they should print.

A command stands in a fenced block of the language bash or sh. A comment before it, `<!-- not run: REASON -->`, says why
a test does not run it. A text block after it is its output: a line "..." stands for any lines. Words must be equal, and
numbers stand where they are shown; their values are not compared: on another processor a trial ends elsewhere.
"""

import re
from pathlib import Path
from typing import List, NamedTuple, Optional

from places import ROOT

LANGUAGES = ('bash', 'sh', 'shell', 'console')
FENCE = re.compile(r'^(`{3,}|:{3,})(\{?[\w-]*\}?)[^\n]*\n(.*?)^\1 *$', re.MULTILINE | re.DOTALL)
NOT_RUN = re.compile(r'^<!-- not run: (.+?) -->$')
NUMBER = re.compile(r'(?<![\w.])[-+]?\d+(?:\.\d+)?(?:e-?\d+)?(?![\w.])')


class Block(NamedTuple):
    """One block of commands."""

    path: Path
    line: int  # of its first command, from 1
    commands: str
    reason_not_to_run: str  # '' for a block that is run
    output: Optional[str]
    output_line: int  # of the output's first line, from 1

    def __str__(self):
        return f'{self.path.relative_to(ROOT)}:{self.line}'


def pages() -> List[Path]:
    """The README first, as its examples come first for a reader; then the site in the order of its menu."""
    docs = ROOT / 'docs'
    menu = re.findall(r'^[\w/]+$', (docs / 'index.md').read_text(), re.MULTILINE)
    in_menu, every = (docs / f'{name}.md' for name in menu), sorted(docs.rglob('*.md'))
    found = [ROOT / 'README.md', *in_menu, ROOT / 'CONTRIBUTING.md', *every]
    return [path for path in dict.fromkeys(found) if path.is_file()]


def blocks_of(path: Path) -> List[Block]:
    """All blocks of commands on a page."""
    blocks, reason = [], ''
    for fence in fences(path.read_text().splitlines()):
        if fence.language in LANGUAGES:
            match = NOT_RUN.match(fence.before)
            reason = match.group(1) if match else ''
            blocks.append(Block(path, fence.line, '\n'.join(fence.lines), reason, None, 0))
        elif fence.language == 'text' and fence.follows_block and blocks:
            blocks[-1] = blocks[-1]._replace(output='\n'.join(fence.lines), output_line=fence.line)
    return blocks


class Fence(NamedTuple):
    """A fenced block of any language."""

    language: str
    line: int  # of its first line of content, from 1
    lines: List[str]
    before: str  # the last line before it that is not blank
    follows_block: bool  # nothing but blank lines between it and the block before


def fences(lines: List[str]) -> List[Fence]:
    """All fenced blocks of a page."""
    text, found, last_end = ''.join(f'{line}\n' for line in lines), [], None
    for match in FENCE.finditer(text):
        between = text[last_end or 0 : match.start()].split('\n')
        before = next((line.strip() for line in reversed(between) if line.strip()), '')
        first = text.count('\n', 0, match.start(3)) + 1
        follows_block = last_end is not None and not before
        found.append(Fence(match.group(2), first, match.group(3).splitlines(), before, follows_block))
        last_end = match.end()
    return found


def difference(expected: str, actual: str) -> str:
    """'' where an output is as shown, else both."""
    shown, printed = plain(expected), plain(actual)
    pattern = ''.join('(?:.*\n)*?' if line == '...' else f'{re.escape(line)}\n' for line in shown)
    if re.fullmatch(pattern, ''.join(f'{line}\n' for line in printed)):
        return ''
    return '\n'.join(['shown:', *shown, 'printed:', *printed])


def plain(text: str) -> List[str]:
    """Lines without colours, times, folders, numbers, blank lines and the widths of columns."""
    text = re.sub(r'\x1b\[[0-9;]*m|\x1b\][^\x07]*\x07|\r', '', text)
    text = re.sub(r'\[\d{10}\.\d+(, \d+\.\d+)?\]', '[TIME]', text)
    text = re.sub(r'(?<![\w.])/(?:[\w.-]+/)+', '/', text)
    text = re.sub(r'(\d+/\d+) (?:yes|no|\?)', r'\1', text)  # what advise concludes from a count
    text = NUMBER.sub('#', text)
    lines = [re.sub(r'-{2,}', '--', re.sub(r'\s+', ' ', line)).strip() for line in text.splitlines()]
    return [line for line in lines if line]
