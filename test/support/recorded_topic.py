"""A topic for displays that keeps what is published."""


class RecordedTopic:
    """In place of diff_encoder_sim.ros.encoded_topics.DisplayTopic."""

    def __init__(self):
        self.has_subscribers, self.newcomers = True, False
        self._messages, self._due_ns = [], None

    def is_due(self, period_ns, now_ns):
        if not self.has_subscribers or (self._due_ns is not None and now_ns - self._due_ns < period_ns):
            return False
        self._due_ns = now_ns
        return True

    def take_newcomers(self):
        newcomers, self.newcomers = self.newcomers, False
        return newcomers

    def publish(self, message):
        self._messages.append(message)

    def take(self):
        """The messages since the last call."""
        messages, self._messages = self._messages, []
        return messages
