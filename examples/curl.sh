#!/usr/bin/env bash
# Every kind of question to a running service (rubscreen serve), with curl alone.
# Usage: [RUBSCREEN_API_KEY=...] examples/curl.sh [URL] [BLADE_FILE]
set -euo pipefail
url="${1:-http://127.0.0.1:8000}"
here="$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)"
blade="${2:-$here/../sdm_core/blade/examples/nasa_rotor_37.json}"
work="$(mktemp -d)"
trap 'rm -rf "$work"' EXIT

# --retry also waits as long as Retry-After says, on 429 and 503. The key is read from a file, because the
# arguments of a process can be seen by everybody on the machine.
asking=(curl --silent --show-error --fail-with-body --retry 5 --max-time 300)
if [ -n "${RUBSCREEN_API_KEY:-}" ]; then
  (umask 077; printf 'Authorization: Bearer %s\n' "$RUBSCREEN_API_KEY" > "$work/key")
  asking+=(--header "@$work/key")
fi

question() { # the rest of the question as JSON members; blade files are JSON already
  printf '{"blade": '; cat "$blade"; printf ', "contact": {"weights": {"LE": 1.0}}, %s}' "$1"
}
post() { # path, members, further options
  question "$2" | "${asking[@]}" --header 'Content-Type: application/json' --data-binary @- "${@:3}" "$url$1"
}

echo "Ready?"
"${asking[@]}" "$url/readyz"; echo

echo "Stable at 241 Hz for K_e = 5,000 and 20,000 N/m?"
post /v1/stability '"speed_hz": [241, 241], "ke": [5000, 20000]'; echo

echo "From which K_e on is it unstable, by the exact core?"
post /v1/boundary '"speed_hz": [200, 241], "ke_max": 25000, "policy": "exact"'; echo

echo "A map as a picture"
post /v1/map '"speed_hz": [150, 200, 250, 300], "ke": [0, 5000, 10000, 15000], "policy": "exact"' \
  --header 'Accept: image/png' --output "$work/map.png"
head -c 4 "$work/map.png" | tail -c 3; echo

echo "What is wrong with a question is said by field, value and remedy"
# Not ${asking[@]}, which would end this script here.
question '"speed_hz": [-1], "ke": [1]' |
  curl --silent ${RUBSCREEN_API_KEY:+--header "@$work/key"} --header 'Content-Type: application/json' \
    --data-binary @- "$url/v1/stability"; echo

echo "The models of the service"
"${asking[@]}" "$url/v1/models" -o "$work/models.json"
head -c 60 "$work/models.json"; echo
