# shellcheck shell=bash
# Completes the arguments of this package's commands in bash, and in zsh by its bashcompinit. Sourced, after the workspace:
#   source "$(rospack find diff_encoder_sim)/config/shell/completion.bash"
# Options and their choices are read from what --help prints, at the first TAB after a command in each shell, so that they
# are always those of the parsers. Names of robots, tests and campaigns are those of the files in config/.

if [ -n "${ZSH_VERSION:-}" ]; then
  autoload -Uz compinit bashcompinit && compinit -u && bashcompinit
  eval '_diff_encoder_sim_config=${${(%):-%x}:A:h:h}'     # bash cannot read this
else
  _diff_encoder_sim_config=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
fi
typeset -A _diff_encoder_sim_helps

# Only these are asked for help: a node takes no --help, and would start. Those in the second line need ROS.
_diff_encoder_sim_commands='advise analyze calibrate campaign check_robot conformance map_bag rasterise_world reencode'
_diff_encoder_sim_of_ros='map_saver place_robot'

# WORDS...: sets COMPREPLY for the word at the cursor, an argument of the command that these words are.
_diff_encoder_sim_arguments() {
  local key="${*: -1}" current=${COMP_WORDS[COMP_CWORD]} option='' index help choices
  [ -n "${_diff_encoder_sim_helps[$key]:-}" ] || _diff_encoder_sim_helps[$key]=$("$@" --help 2>/dev/null </dev/null)
  help=${_diff_encoder_sim_helps[$key]}
  for ((index = $#; index < COMP_CWORD; index++)); do
    case ${COMP_WORDS[index]} in -*) option=${COMP_WORDS[index]} ;; esac
  done
  case $current in
    -*) choices=$(grep -oE -- '(^|[][ |,(])--?[a-z][a-z-]*' <<<"$help" | grep -oE -- '--?[a-z-]+') ;;
    *) choices=$(_diff_encoder_sim_values "$key" "$option" "$help") ;;
  esac
  _diff_encoder_sim_reply "$choices"
}

# COMMAND OPTION HELP: prints the values that an option takes, a line each; '' stands for the arguments without one.
_diff_encoder_sim_values() {
  case "$1 $2" in
    *' --robot' | check?robot' ') _diff_encoder_sim_names robots ;;
    *' --tests') _diff_encoder_sim_names tests ;;
    *' --encoders' | *' --encoder') echo catalogue && _diff_encoder_sim_names encoders ;;
    *' --imu') _diff_encoder_sim_names imu ;;
    *' --amcl') _diff_encoder_sim_names . | grep '^amcl' ;;
    'campaign --config' | 'advise --config') _diff_encoder_sim_names campaigns ;;
    *' -'*) grep -oE -- "$2 \{[^}]*\}" <<<"$3" | head -n 1 | grep -oE '\{.*\}' | tr -d '{}' | tr ',' '\n' ;;
  esac
}

_diff_encoder_sim_names() { (cd "$_diff_encoder_sim_config/$1" && ls) | sed -n 's/\.yaml$//p'; }

# CHOICES: offers those, a line each, that begin with the word at the cursor; where there are none, the shell offers files.
_diff_encoder_sim_reply() {
  local choice current=${COMP_WORDS[COMP_CWORD]}
  COMPREPLY=()
  while read -r choice; do
    case $choice in "$current"*) COMPREPLY+=("$choice") ;; esac
  done < <(sort -u <<<"$1" | grep .)
}

# rosrun diff_encoder_sim COMMAND ...; all else is left to ROS's own completion, where there is one.
_diff_encoder_sim_rosrun() {
  local commands="$_diff_encoder_sim_commands $_diff_encoder_sim_of_ros"
  if [ "$COMP_CWORD" -gt 2 ] && [ "${COMP_WORDS[1]}" = diff_encoder_sim ]; then
    case " $commands " in *" ${COMP_WORDS[2]} "*) _diff_encoder_sim_arguments "${COMP_WORDS[@]:0:3}" ;; esac
    return
  fi
  if ! declare -f _roscomplete_exe >/dev/null && declare -f _completion_loader >/dev/null; then
    _completion_loader rosrun                                    # Debian's, which has not been needed yet
    complete -o default -F _diff_encoder_sim_rosrun rosrun       # it has replaced ours
  fi
  ! declare -f _roscomplete_exe >/dev/null || _roscomplete_exe
  if [ "$COMP_CWORD" -eq 2 ] && [ "${COMP_WORDS[1]}" = diff_encoder_sim ]; then
    [ ${#COMPREPLY[@]} -gt 0 ] || _diff_encoder_sim_reply "$(tr ' ' '\n' <<<"$commands")"     # ROS knows none in a devel space
  elif [ -n "${ZSH_VERSION:-}" ]; then
    compcall                                                     # ROS's for zsh
  fi
}

# diff-encoder-sim COMMAND ..., which pip installs.
_diff_encoder_sim_console() {
  if [ "$COMP_CWORD" -gt 1 ]; then
    _diff_encoder_sim_arguments "${COMP_WORDS[@]:0:2}"
  else
    _diff_encoder_sim_reply "$(tr ' _' '\n-' <<<"$_diff_encoder_sim_commands")"
  fi
}

complete -o default -F _diff_encoder_sim_rosrun rosrun
complete -o default -F _diff_encoder_sim_console diff-encoder-sim
