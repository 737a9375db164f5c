#!/usr/bin/env bash
# Sets up, runs a small campaign, and makes a report of it: which encoder reaches which accuracy, in about a minute.
#   bash scripts/quickstart.sh                            config/campaigns/quick.yaml
#   bash scripts/quickstart.sh --config paper --trials 3  options go to campaign; without --out the results go to a new folder
#                                                         below results/
set -euo pipefail
# shellcheck source=scripts/lib.sh
source "$(dirname "${BASH_SOURCE[0]}")/lib.sh"

arguments=("$@")
[[ " $* " =~ \ --config[\ =] ]] || arguments=(--config quick "$@")

main() {
  [[ " ${arguments[*]} " != *" --help "* ]] || { sed -n '2,5s/^# \{0,1\}//p' "${BASH_SOURCE[0]}"; exit 0; }
  bash "$root/scripts/setup.sh"
  drop_root "${arguments[@]}"
  choose_folder
  source_workspace
  say "rosrun diff_encoder_sim campaign ${arguments[*]}"
  rosrun diff_encoder_sim campaign "${arguments[@]}" || die "the campaign did not come to its end (it ended with $?)"
  say "rosrun diff_encoder_sim analyze $folder"
  rosrun diff_encoder_sim analyze "$folder"
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
