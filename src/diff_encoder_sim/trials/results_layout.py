"""Names of the files in a campaign's results folder."""

MANIFEST, TABLE, BAGS, LOCK = 'manifest.json', 'trials.csv', 'bags', '.lock'
