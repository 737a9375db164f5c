from pathlib import Path

from rosbags.highlevel import AnyReader

from diff_encoder_sim import api

api.run_campaign('made', 'quick', tests=['SMT'], ppr=[90], trials=1, nav='scripted', workers=1)
with AnyReader([Path('made/bags/SMT_90_001.bag')]) as reader:
    [found] = [connection for connection in reader.connections if connection.topic == '/wheel_travel']
    numbers = [int(reader.deserialize(raw, each.msgtype).data) for each, _, raw in reader.messages([found])]
assert len(numbers) > 100 and max(map(abs, numbers)) > 100, numbers
