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
printf '.SH FILES\n'
verbatim << 'FILES'
run.csv     one recording: meta data in lines that begin with "# ", a row of names with units, numbers
rig.toml    one structure: section, elements with mass and flexibility, gauge; or its modes
fit.json, apparent.json, diagnosis.json, trial.json, check.json     results
corrected.csv, indicial.csv, simulated.csv                          results in columns
campaigns.toml, table.csv                                           many campaigns for batch, and its table
law.toml    a law of one's own
limits.toml, plan.toml      what can be recorded, and what propose proposes
FILES
printf 'Their formats: share/doc/unrig/manual/run_files.md, rig_files.md, laws.md, results.md, propose.md, batch.md.\n'
printf '.SH EXIT STATUS\n'
verbatim << 'STATUS'
0    done; warnings, if there are any, on standard error
1    the question has no trustworthy answer; why is said
2    wrong use, or input that cannot be used
130  interrupted; nothing is half-written
STATUS
printf '.SH EXAMPLES\n'
verbatim << 'EXAMPLES'
unrig new rig --from tube -o rig.toml
unrig import log.csv --template -o map.toml
unrig import log_1.csv log_2.csv --map map.toml --set speed="0.6 m/s" -o runs/
unrig check --rig rig.toml dry_pluck.csv wet_pluck.csv step_a.csv
unrig fit --rig rig.toml dry_pluck.csv wet_pluck.csv step_a.csv -o fit.json
unrig correct --rig rig.toml --fit fit.json step_a.csv -o corrected.csv --indicial indicial.csv
unrig diagnose --rig rig.toml dry_pluck.csv wet_pluck.csv step_a.csv -o diagnosis.json
unrig propose diagnosis.json --limits limits.toml -o plan.toml
unrig report fit.json corrected.csv -o report.html
unrig batch campaigns.toml -o table.csv
EXAMPLES
printf '.SH SEE ALSO\nshare/doc/unrig/manual: run files, rig files, results and verdicts, effects, method, library.\n'
