#!/usr/bin/env bash
# Sets up, runs a few closed-loop trials, finds the encoder that the paper's robot needs, and writes a report of both, in two
# minutes.
#   bash scripts/quickstart.sh                            two trials of each cell of config/campaigns/quick.yaml
#   bash scripts/quickstart.sh --config paper --trials 3  options go to campaign; without --out the results go to a new folder
#                                                         below results/
set -euo pipefail
# shellcheck source=scripts/lib.sh
source "$(dirname "${BASH_SOURCE[0]}")/lib.sh"

arguments=("$@")
[[ " $* " =~ \ --trials[\ =] || " $* " =~ \ --config[\ =] ]] || arguments=(--trials 2 "${arguments[@]}")
[[ " $* " =~ \ --config[\ =] ]] || arguments=(--config quick "${arguments[@]}")

main() {
  [[ " ${arguments[*]} " != *" --help "* ]] || { sed -n '2,6s/^# \{0,1\}//p' "${BASH_SOURCE[0]}"; exit 0; }
  bash "$root/scripts/setup.sh"
  drop_root "${arguments[@]}"
  choose_folder
  source_workspace
  say "rosrun diff_encoder_sim campaign ${arguments[*]}"
  rosrun diff_encoder_sim campaign "${arguments[@]}" || die "the campaign did not come to its end (it ended with $?)"
  say "rosrun diff_encoder_sim advise --robot $(robot) --no-trials --out $folder/advice"
  rosrun diff_encoder_sim advise --robot "$(robot)" --no-trials --out "$folder/advice"
  say "rosrun diff_encoder_sim analyze $folder"    # its report starts with the answer of advise
  rosrun diff_encoder_sim analyze "$folder"
  say "which encoder: open $folder/advice/advice.html"
}

# The robot of the campaign: what --robot says, or alto.
robot() {
  local index
  for index in "${!arguments[@]}"; do
    case ${arguments[index]} in
      --robot) echo "${arguments[index + 1]:-}"; return ;;
      --robot=*) echo "${arguments[index]#--robot=}"; return ;;
    esac
  done
  echo alto
}

# The folder of the results: what --out says, or a new one.
choose_folder() {
  folder=$root/results/$(date -u +%Y%m%dT%H%M%SZ)
  local index
  for index in "${!arguments[@]}"; do
    case ${arguments[index]} in
      --out) folder=${arguments[index + 1]:-}; return ;;
      --out=*) folder=${arguments[index]#--out=}; return ;;
    esac
  done
  arguments+=(--out "$folder")
}

main
