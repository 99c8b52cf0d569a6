# bash completion of unrig: commands and options are asked from the program itself, so that they are never out of date.
_unrig() {
  local previous=${COMP_WORDS[COMP_CWORD-1]} current=${COMP_WORDS[COMP_CWORD]} program=${COMP_WORDS[0]}
  COMPREPLY=()
  if ((COMP_CWORD == 1)); then
    mapfile -t COMPREPLY < <(compgen -W "$("$program" --help 2>/dev/null | sed -n 's/^  \([a-z][a-z-]*\) .*/\1/p') --help --version" -- "$current")
  elif [[ $previous == --effect || $previous == --effects ]]; then  # names, the last of a list too
    local list=
    [[ $previous == --effects && $current == *,* ]] && list=${current%,*},
    mapfile -t COMPREPLY < <(compgen -P "$list" -W "$("$program" fit --help 2>/dev/null | sed -n '/^Effects:/,/^$/s/^  \([a-z-]*\) .*/\1/p')" -- "${current#"$list"}")
  elif [[ $current == -* ]]; then
    mapfile -t COMPREPLY < <(compgen -W "$("$program" "${COMP_WORDS[1]}" --help 2>/dev/null | grep -oE -- '^ +-[^ ]+' | tr ',' '\n' | tr -d ' ')" -- "$current")
  fi
}
complete -o default -F _unrig unrig
