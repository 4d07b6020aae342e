#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# terminal_test.sh AXISCAL: runs a whole session by key presses in a terminal of 80 x 24 characters
# (tmux). The exit status is 77 if tmux is not installed.
set -euo pipefail
axiscal=$1
command -v tmux >/dev/null || { echo "skipped: no tmux"; exit 77; }
work=$(mktemp -d)
socket="axiscal-$$"
# The window is named with its session: tmux matches a bare "s" also with the beginning of a
# window's name, and window names change by themselves.
window=s:0
screen() { tmux -L "$socket" capture-pane -p -t "$window"; }
press() { tmux -L "$socket" send-keys -t "$window" "$1"; }
clean_up() {
  tmux -L "$socket" kill-server 2>/dev/null || true
  rm -rf "$work"
}
trap clean_up EXIT
fail() {
  echo "$1"
  screen || true
  exit 1
}
# No pipe into grep: grep -q exits at the first match, and the writer of the pipe could then fail
# (SIGPIPE).
shows() { grep -qE "$1" <<<"$(screen)"; }
# Waits for a text on the screen.
await() {
  for _ in $(seq 400); do
    if shows "$1"; then return 0; fi
    sleep 0.05
  done
  fail "never shown: $1"
}

# Takes a reading. A key that is pressed while the instrument moves takes none, so the key is
# pressed again.
take() {
  for _ in $(seq 10); do
    await "Ready: take the reading|All points are done"
    press Space
    for _ in $(seq 40); do
      if shows "$1 done"; then return 0; fi
      sleep 0.05
    done
  done
  fail "reading $1 was never taken"
}

cd "$work"
tmux -L "$socket" -f /dev/null new-session -d -s s -x 80 -y 24 \
  "'$axiscal' acquire --connect 'sim:?speed=20&seed=2' --manual --name keys; echo status \$?; sleep 60"
await "Ready: take the reading"
shows "on the table: " || fail "no cube"
[ "$(screen | awk '{ if (length($0) > 80) n++ } END { print n + 0 }')" = 0 ] || fail "wider than 80"
take 1
press u
await "0 done, 12 to go"
press p
await "Paused"
press g
await "s skip"
press s
await "0 done, 11 to go"
for done in $(seq 11); do
  take "$done"
done
# A simulated reading can look wrong by chance. That is no fault here; the search for wrong readings
# has its own tests.
await "All points are done|Some points look wrong"
press f
# The result stays on the screen until a key is pressed.
await "q leave"
shows "Calibrated" || fail "no verdict"
shows "^ x  +-?[0-9.]+" || fail "no coefficients"
shows "± [0-9.]+( .*± [0-9.]+){3}" || fail "no U of all four"
press q
await "status 0"
[ -s keys.json ] && [ -s keys.csv ] && [ -s keys.html ] || fail "no files"

# ^C asks for a confirmation before the session stops.
window=s:1
tmux -L "$socket" -f /dev/null new-window -t "$window" \
  "'$axiscal' acquire --connect 'sim:?speed=5' --name small; echo status \$?; sleep 60"
await "still|moving"
press C-c
await "press q once more"
press q
await "status 1"

# If the window is too small, the session shows its size instead of the screen.
window=s:2
tmux -L "$socket" -f /dev/null new-window -t "$window" \
  "'$axiscal' acquire --connect 'sim:?speed=5' --manual --name tiny; echo status \$?; sleep 60"
await "still|moving"
tmux -L "$socket" resize-window -t "$window" -x 60 -y 20
await "This window is 60 x 20"
tmux -L "$socket" resize-window -t "$window" -x 80 -y 24
await "still|moving"
echo "ok"
