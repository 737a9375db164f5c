"""A campaign's manifest.json, made up."""

STRAIGHT_20_M = {
    'name': 'SL',
    'world': 'hallway',
    'start': {'x': 0.0, 'y': 0.0, 'yaw': 0.0},
    'route': [{'goal': {'x': 20.0, 'y': 0.0, 'yaw': 0.0}}],
}


def manifest():
    return {
        'fingerprint': 'f00d',
        'seeds': {'first': 1, 'last': 30},
        'runs': [
            {
                'started': '2026-01-02T03:04:05+00:00',
                'command': ['/ws/scripts/campaign', '--config', 'my file.yaml', '--out', 'results'],
                'versions': {'numpy': '2.0', 'dask': None},
                'commit': {'id': 'abc', 'is_dirty': True},
                'machine': {'cpu': 'a chip', 'cores': 4, 'usable_cores': 2, 'memory_bytes': 8 * 2**30, 'os': 'Linux'},
            }
        ],
        'configuration': {'nav': 'embedded', 'tests': [STRAIGHT_20_M]},
    }
