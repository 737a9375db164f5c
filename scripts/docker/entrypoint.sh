#!/usr/bin/env bash
# What the images run: the workspace is sourced, as in every shell that uses it, and the command starts.
source "$(dirname "${BASH_SOURCE[0]}")/../../.ws/devel/setup.bash"
exec "$@"
