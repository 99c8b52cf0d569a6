#!/bin/sh
# A test under the sanitizers, until UNRIG_SANITIZED_UNTIL (seconds since 1970) where that is set: what is not done by then is counted as skipped.
[ -n "${UNRIG_SANITIZED_UNTIL-}" ] || exec "$@"
left=$((UNRIG_SANITIZED_UNTIL - $(date +%s)))
[ "$left" -gt 0 ] || { echo "[  SKIPPED ] not begun: no time was left"; exit 0; }
status=0
TMPDIR=$(mktemp -d)  # whose files nobody else clears away where the test is cut off
export TMPDIR
trap 'rm -rf "$TMPDIR"' EXIT
timeout --kill-after=5 "$left" "$@" || status=$?
[ "$status" != 124 ] || { echo "[  SKIPPED ] cut off after $left s without a finding"; exit 0; }
exit "$status"
