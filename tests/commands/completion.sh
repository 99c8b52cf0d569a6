#!/bin/sh
# sh completion.sh UNRIG FOLDER: what the shells complete with the scripts in FOLDER. Those that are not there are named and left out.
set -u
unrig=$1 folder=$2 failed=0
# says SHELL WHAT WANTED GOT: whether the wanted word stands in a line of its own in what was completed.
says() {
  if printf '%s\n' "$4" | cut -f 1 | cut -d : -f 1 | grep -qx -- "$3"; then echo "$1: $2 gives $3"
  else echo "$1: $2 should give $3, but: $4" >&2; failed=1; fi
}
in_bash() { bash -c 'source "$0"; COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); _unrig; printf "%s\n" "${COMPREPLY[@]}"' "$folder/unrig.bash" "$unrig" "$@"; }
in_fish() { fish --no-config -c 'source $argv[1]; set -gx PATH (dirname $argv[2]) $PATH; complete -C "unrig $argv[3..]"' "$folder/unrig.fish" "$unrig" "$@"; }
in_zsh() {
  zsh -f -c 'compdef() { }; compadd() { print -l -- ${@:#--} }; compset() { }; _describe() { print -l -- ${(P)2} }; _files() { }
    source $1; shift; words=("$@"); CURRENT=$#; _unrig' zsh "$folder/_unrig" "$unrig" "$@"
}
for shell in bash fish zsh; do
  if ! command -v "$shell" > /dev/null; then echo "$shell is not there: left out"; continue; fi
  says "$shell" "a command" diagnose "$("in_$shell" dia)"
  says "$shell" "an option" --heldout "$("in_$shell" diagnose --hel)"
  says "$shell" "an option" --limits "$("in_$shell" propose --lim)"
  says "$shell" "an effect" quadratic-drag "$("in_$shell" fit --effect quadr)"
done
exit "$failed"
