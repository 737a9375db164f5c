"""What a bag contains about its trial: the texts of /trial and /trial_result."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, Dict, Iterator, NamedTuple, Optional, Tuple

from diff_encoder_sim.base.errors import ConfigError, InputFault
from diff_encoder_sim.drives.bag_source import BagSource
from diff_encoder_sim.drives.basic_messages import decode_string
from diff_encoder_sim.drives.message_types import STRING
from diff_encoder_sim.drives.topics import TRIAL, TRIAL_RESULT
from diff_encoder_sim.drives.trial_definition import Trial
from diff_encoder_sim.drives.trial_outcome import Outcome


class TrialMetadata(NamedTuple):
    """The trial that a bag was recorded from, and how it ended."""

    trial: Trial
    outcome: Outcome  # torn where the bag has no result
    reason: str  # of a failure


def read_metadata(path: Path, source: BagSource) -> Optional[TrialMetadata]:
    """Read the trial of a bag and its result; None where the bag has no /trial.

    Raises:
        ConfigError: one of the texts is not as expected.
    """
    texts = dict(_texts(path, source, TRIAL, TRIAL_RESULT))
    if TRIAL not in texts:
        return None
    trial = _trial(path, texts[TRIAL])
    result = _json(path, TRIAL_RESULT, texts.get(TRIAL_RESULT, '{}'))
    return TrialMetadata(trial, _outcome(path, result), str(result.get('reason', '')))


def trial_of_source(path: Path, source: BagSource) -> Optional[Trial]:
    """Read the trial that a bag was recorded from; None where the bag has no /trial.

    Raises:
        ConfigError: /trial is not as expected.
    """
    for _, text in _texts(path, source, TRIAL):
        return _trial(path, text)
    return None


def _texts(path: Path, source: BagSource, *topics: str) -> Iterator[Tuple[str, str]]:
    strings = [topic for topic in topics if source.topics.get(topic) == STRING]
    for message in source.messages(strings) if strings else ():
        try:
            yield message.topic, decode_string(message.raw, source.is_cdr)
        except InputFault as error:
            raise ConfigError(f'{path}: {message.topic}: {error}') from None


def _trial(path: Path, text: str) -> Trial:
    return Trial.from_mapping(_json(path, TRIAL, text), f'{path}: {TRIAL}')


def _outcome(path: Path, result: Dict[str, Any]) -> Outcome:
    given = result.get('outcome', Outcome.TORN.value)
    try:
        return Outcome(given)
    except ValueError:
        allowed = ', '.join(outcome.value for outcome in Outcome)
        raise ConfigError(f'{path}: {TRIAL_RESULT}: outcome: given {given!r}; allowed: {allowed}') from None


def _json(path: Path, topic: str, text: str) -> Dict[str, Any]:
    try:
        content = json.loads(text)
    except json.JSONDecodeError as error:
        raise ConfigError(f'{path}: {topic}: not JSON: {error}') from None
    if not isinstance(content, dict):
        raise ConfigError(f'{path}: {topic}: given {text[:60]!r}; expected a JSON object')
    return content
