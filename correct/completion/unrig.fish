# fish completion of unrig: commands and options are asked from the program itself, so that they are never out of date.
function __unrig_commands
    set -l words (commandline -opc)
    $words[1] --help 2>/dev/null | string replace -rf '^  ([a-z][a-z-]*) +(.*)' '$1\t$2'
    printf '%s\n' --help --version
end
function __unrig_options
    set -l words (commandline -opc)
    $words[1] $words[2] --help 2>/dev/null | string match -r '^ +-[^ ]+' | string split , | string trim
end
function __unrig_effects
    set -l words (commandline -opc)
    $words[1] fit --help 2>/dev/null | sed -n '/^Effects:/,/^$/s/^  \([a-z-]*\) .*/\1/p'
end
function __unrig_before
    set -l words (commandline -opc)
    contains -- $words[-1] $argv
end
complete -c unrig -n 'test (count (commandline -opc)) -eq 1' -f -a '(__unrig_commands)'
complete -c unrig -n 'test (count (commandline -opc)) -gt 1; and not __unrig_before --effect --effects; and string match -q -- "-*" (commandline -ct)' -f -a '(__unrig_options)'
complete -c unrig -n '__unrig_before --effect --effects' -f -a '(__unrig_effects)'
