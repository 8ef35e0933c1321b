#!/usr/bin/env bash
# A batch of blades as a durable job of a running service (rubscreen serve), with curl alone.
# Usage: [RUBSCREEN_API_KEY=...] examples/batch.sh [URL] [BLADE_FILE...]
set -euo pipefail
url="${1:-http://127.0.0.1:8000}"
here="$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)"
shift || true
[ $# -gt 0 ] || set -- "$here/../sdm_core/blade/examples/nasa_rotor_37.json"
work="$(mktemp -d)"
trap 'rm -rf "$work"' EXIT

asking=(curl --silent --show-error --fail-with-body --retry 5)
if [ -n "${RUBSCREEN_API_KEY:-}" ]; then
  (umask 077; printf 'Authorization: Bearer %s\n' "$RUBSCREEN_API_KEY" > "$work/key")
  asking+=(--header "@$work/key")
fi
member() { # the first member of this name in a JSON document of the service
  sed -n "s/.*\"$1\":\"\([^\"]*\)\".*/\1/p" | head -n 1
}

echo "The files, sent ahead: a list as JSON (or one a line as application/x-ndjson, or a zip)"
{ printf '['; first=1; for file in "$@"; do [ $first ] || printf ','; first=; cat "$file"; done; printf ']'; } > "$work/blades.json"
upload="$("${asking[@]}" --header 'Content-Type: application/json' --data-binary "@$work/blades.json" \
  "$url/v1/uploads?name=blades.json" | member id)"
echo "upload $upload"

echo "The job: the same body under the same key is the same job, however often it is sent"
cat > "$work/order.json" <<JSON
{"name": "from the shell", "blades": [{"upload": "$upload"}, {"example": "generic_compressor_blade"}],
 "contacts": [{"name": "LE", "weights": {"LE": 1}}, {"name": "both", "weights": {"LE": 1, "TE": 1}}],
 "ke_liner": 9000, "criteria": {"least_margin": 0.2}, "map_shape": [32, 32]}
JSON
key="batch-$(date +%s)-$$"
order() {
  "${asking[@]}" --header 'Content-Type: application/json' --header "Idempotency-Key: $key" \
    --data-binary "@$work/order.json" "$url/v1/screenings"
}
job="$(order | member id)"
[ "$(order | member id)" = "$job" ]
echo "job $job"

echo "Its events: progress at every change, and done, failed or cancelled at the end"
over=
until [ -n "$over" ]; do # --no-buffer: as they come; the loop: the service may be started again meanwhile
  "${asking[@]}" --no-buffer --max-time 600 "$url/v1/screenings/$job/events" | grep --line-buffered '^event: ' || sleep 2
  state="$("${asking[@]}" "$url/v1/screenings/$job" | member state)"
  case "$state" in done|failed|cancelled) over=1 ;; esac
done
[ "$state" = done ]

echo "The ranking, safest first"
"${asking[@]}" --header 'Accept: text/csv' "$url/v1/screenings/$job/results" | cut -d, -f1,4,5,6,16
echo "Those that miss the criteria: $("${asking[@]}" "$url/v1/screenings/$job/results?meets_criteria=false&limit=1" |
  sed -n 's/.*"total":\([0-9]*\).*/\1/p')"
"${asking[@]}" --output "$work/report.html" "$url/v1/screenings/$job/report"
"${asking[@]}" --output "$work/map.png" "$url/v1/screenings/$job/blades/0/map.png?contact=LE"
echo "A report of $(wc -c < "$work/report.html") bytes, a map of $(wc -c < "$work/map.png")"
