#!/bin/sh
# A test under the sanitizers, for no longer than UNRIG_SANITIZED_SECONDS where that is set: then it has been without a finding for that long, and is counted as skipped.
[ -n "${UNRIG_SANITIZED_SECONDS-}" ] || exec "$@"
status=0
TMPDIR=$(mktemp -d)  # whose files nobody else clears away where the test is cut off
export TMPDIR
trap 'rm -rf "$TMPDIR"' EXIT
timeout --kill-after=5 "$UNRIG_SANITIZED_SECONDS" "$@" || status=$?
[ "$status" != 124 ] || { echo "[  SKIPPED ] cut off after $UNRIG_SANITIZED_SECONDS s without a finding"; exit 0; }
exit "$status"
