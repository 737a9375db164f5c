"""How the pages' commands are found, and an output that a page shows is compared with what a command prints."""

import pytest

from documented_commands import difference, fences

PRINTED = """\x1b[1mstarted\x1b[0m in /tmp/a/b
[INFO] [1795322635.214572, 48.910000] [/node]: 0.039 m from the goal

test    PPR    world
------  -----  -----
SL        40    67
done: /home/me/sl.bag
"""


@pytest.mark.parametrize(
    'shown',
    [
        PRINTED,
        'started in /elsewhere/b\n...',
        '...\n[INFO] [1795999999.000000, 1.910000] [/node]: 0.052 m from the goal\n...',
        '...\ntest  PPR   world\n---  ---  ---\nSL   90   100\n...',
        '...\ndone: /root/sl.bag',
        'started in /tmp/a/b\n...\ndone: /sl.bag',
    ],
)
def test_numbers_times_folders_and_widths_may_differ(shown):
    assert difference(shown, PRINTED) == ''


@pytest.mark.parametrize(
    'shown', ['started in /tmp/a/b', '...\nSMT  40  67\n...', 'done: /sl.bag\n...', '...\nSL  40\n...', '']
)
def test_words_lines_and_columns_may_not(shown):
    assert 'printed:' in difference(shown, PRINTED)


def test_a_block_knows_what_stands_before_it():
    page = ['<!-- not run: slow -->', '```bash', 'a', '```', '', '```text', 'b', '```', 'words', '```text', 'c', '```']
    found = [(fence.language, fence.before, fence.follows_block) for fence in fences(page)]
    assert found == [('bash', '<!-- not run: slow -->', False), ('text', '', True), ('text', 'words', False)]
