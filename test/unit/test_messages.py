"""All messages of the package are in one file, test/messages.txt: other tests check type, key and value of errors.

MESSAGES=write writes the file; read its diff as a user would.
"""

import ast
import os

from places import ROOT

PACKAGE, SNAPSHOT = ROOT / 'src' / 'diff_encoder_sim', ROOT / 'test' / 'messages.txt'
ERRORS = {
    'ConfigError',
    'MissingLibrary',
    'CampaignFault',
    'InputFault',
    'NoTransform',
    'ArgumentTypeError',
    'not_allowed',
    'exit',
    'error',
}
LOGGED = {'warning', 'info', 'warn', 'loginfo', 'logwarn', 'logerr', 'logfatal'}


def test_the_messages_are_those_of_the_snapshot():
    messages = '\n'.join(f'{room}: {text}' for room, text in sorted(set(all_messages()))) + '\n'
    if os.environ.get('MESSAGES') == 'write':
        SNAPSHOT.write_text(messages)
    assert messages.splitlines() == SNAPSHOT.read_text().splitlines()


def all_messages():
    """Yield room and text of each error and log message; what differs from time to time is in braces."""
    for path in PACKAGE.rglob('*.py'):
        for node in ast.walk(ast.parse(path.read_text(encoding='utf-8'))):
            if isinstance(node, ast.Call) and name_of(node.func) in ERRORS | LOGGED:
                texts = [text_of(argument) for argument in node.args]
                if any(' ' in text for text in texts):
                    yield path.relative_to(PACKAGE).parts[0], max(texts, key=len)


def name_of(function):
    return function.attr if isinstance(function, ast.Attribute) else getattr(function, 'id', '')


def text_of(node):
    """The text of a string or an f-string with its expressions as {}, else ''."""
    if isinstance(node, ast.Constant):
        return repr(node.value)[1:-1] if isinstance(node.value, str) else ''
    parts = node.values if isinstance(node, ast.JoinedStr) else []
    return ''.join(text_of(part) if isinstance(part, ast.Constant) else '{}' for part in parts)
