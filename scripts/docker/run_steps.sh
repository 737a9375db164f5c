#!/usr/bin/env bash
# Runs the steps of a Dockerfile without Docker, in a system that debootstrap made; as root.
#   bash scripts/docker/run_steps.sh DOCKERFILE ROOT COMMAND...
# ROOT is made where it does not exist, as debian:bookworm-slim is: minbase. COMMAND is then run as `docker run` runs it.
set -euo pipefail
checkout=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd -P)
dockerfile=$1 system=$2; shift 2
user=root folder=/ entrypoint=() steps=0

main() {
  [ -d "$system/usr" ] || make_system
  for each in proc dev sys; do mount --rbind "/$each" "$system/$each"; mount --make-rslave "$system/$each"; done
  trap 'umount -l "$system"/{proc,dev,sys}' EXIT
  while read -r -u 3 word rest; do step "$word" "$rest"; done 3< <(grep -vE '^(#|$)' "$dockerfile")
  echo "$steps steps; $user: $*"
  inside "$user" "${entrypoint[@]}" "$@"
}

# With the network's settings, as Docker sets them: names, proxy, certificates.
make_system() {
  local path
  debootstrap --variant=minbase bookworm "$system" >/dev/null
  for path in /etc/resolv.conf /etc/hosts /etc/pip.conf /etc/apt/apt.conf.d/*proxy* /usr/local/share/ca-certificates/*; do
    [ ! -f "$path" ] || install -D -m 644 "$path" "$system$path"
  done
}

step() {
  echo "$1 $2"
  steps=$((steps + 1))
  case $1 in
    FROM | CMD) ;;
    RUN) inside "$user" bash -c "$2" ;;
    COPY) copy $2 ;;
    USER) user=$2 ;;
    WORKDIR) folder=$2 ;;
    ENTRYPOINT) mapfile -t entrypoint < <(grep -oE '"[^"]*"' <<<"$2" | tr -d '"') ;;
    *) echo "unknown step: $1" >&2; exit 1 ;;
  esac
}

# --chown=USER . FOLDER: what .dockerignore leaves.
copy() {
  mkdir -p "$system$3"
  tar -C "$checkout" --exclude-from=<(sed 's|^|./|' "$checkout/.dockerignore") -c . | tar -C "$system$3" -x
  inside root chown -R "${1#--chown=}:" "$3"
}

# USER COMMAND...
inside() {
  chroot "$system" setpriv --reuid="$1" --regid="$1" --init-groups env -i --chdir="$folder" HOME="$(home_of "$1")" TERM=dumb \
    PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin "${@:2}"
}

home_of() { case $1 in root) echo /root ;; *) echo "/home/$1" ;; esac; }

main "$@"
