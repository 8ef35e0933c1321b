#!/usr/bin/env bash
# Ask a running service (rubscreen serve) about NASA rotor 37.
# Usage: examples/rest_example.sh [URL] [BLADE_FILE]
set -euo pipefail
url="${1:-http://127.0.0.1:8000}"
here="$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)"
blade="${2:-$here/../sdm_core/blade/examples/nasa_rotor_37.json}"

ask() { # path, then the rest of the question as JSON members
  { printf '{"blade": '; cat "$blade"; printf ', %s}' "$2"; } |
    curl --silent --show-error --fail-with-body --header 'Content-Type: application/json' --data-binary @- "$url$1"
  echo
}

echo "ready?"
curl --silent --show-error --fail-with-body "$url/readyz"
echo

echo "Stable at 241 Hz for K_e = 5,000 and 20,000 N/m, leading edge in contact?"
ask /v1/stability '"contact": {"weights": {"LE": 1.0}}, "speed_hz": [241, 241], "ke": [5000, 20000]'

echo "Smallest K_e that destabilises it at three speeds, by the exact core, both edges in contact"
ask /v1/boundary '"contact": {"weights": {"LE": 1.0, "TE": 1.0}}, "speed_hz": [150, 200, 241], "ke_max": 25000, "policy": "exact"'
