#!/bin/sh
# sh manual.sh UNRIG: the manual page on standard output, made from what `UNRIG --help` and `UNRIG COMMAND --help` say.
set -eu
unrig=$1
verbatim() { printf '.nf\n'; sed -e 's/\\/\\e/g' -e 's/-/\\-/g' -e "s/^[.']/\\\\\&&/"; printf '.fi\n'; }
help=$("$unrig" --help)
printf '.TH UNRIG 1 "" "%s" "User Commands"\n' "$("$unrig" --version)"
printf '.SH NAME\nunrig \\- take the rig out of the reading of a strain\\-gauge load cell\n'
printf '.SH SYNOPSIS\n.B unrig\n.I COMMAND\n[\n.I OPTIONS\n]\n.SH COMMANDS\n'
echo "$help" | verbatim
for command in $(echo "$help" | sed -n 's/^  \([a-z][a-z-]*\) .*/\1/p'); do
  printf '.SH unrig %s\n' "$(echo "$command" | sed 's/-/\\-/g')"
  "$unrig" "$command" --help | verbatim
done
printf '.SH SEE ALSO\nshare/doc/unrig/manual: run files, rig files, results and verdicts, effects, method, library.\n'
