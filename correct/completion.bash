# bash completion of unrig: commands and options are asked from the program itself, so that they are never out of date.
_unrig() {
  local current=${COMP_WORDS[COMP_CWORD]} program=${COMP_WORDS[0]}
  COMPREPLY=()
  if ((COMP_CWORD == 1)); then
    mapfile -t COMPREPLY < <(compgen -W "$("$program" --help 2>/dev/null | sed -n 's/^  \([a-z][a-z-]*\) .*/\1/p') --help --version" -- "$current")
  elif [[ $current == -* ]]; then
    mapfile -t COMPREPLY < <(compgen -W "$("$program" "${COMP_WORDS[1]}" --help 2>/dev/null | grep -oE -- '^ +-[^ ]+' | tr ',' '\n' | tr -d ' ')" -- "$current")
  fi
}
complete -o default -F _unrig unrig
