#!/bin/sh
# The editors' tests: the packaged extension in a real Visual Studio Code, and the other editors that are installed.
# INSTALL=1 gets what is missing from the system's packages, where that is Debian and the user may.
set -eu
cd "$(dirname "$0")/.."

note() {
    printf '\n%s\n*** %s\n%s\n\n' "$(printf '%078d' 0 | tr 0 '*')" "$1" "$(printf '%078d' 0 | tr 0 '*')" >&2
}
have() { command -v "$1" >/dev/null 2>&1; }
browser() {
    for name in chromium chromium-browser google-chrome; do
        if have "$name"; then command -v "$name"; return; fi
    done
}
new_node() { have npm && have node && [ "$(node -p 'parseInt(process.versions.node)')" -ge 20 ]; }
seconds() { now=$(date +%s); echo "$1: $((now - since)) s"; since=$now; }

# Get packages, all at once; one by one if that fails, so that one that is unknown here costs no other.
install() {
    export DEBIAN_FRONTEND=noninteractive
    timeout 120 apt-get update -qq >/dev/null || { note "the lists of the system's packages could not be had"; return 0; }
    timeout 400 apt-get install -y -qq --no-install-recommends "$@" >/dev/null && return 0
    for package; do
        timeout 300 apt-get install -y -qq --no-install-recommends "$package" >/dev/null || note "$package could not be installed"
    done
}

# What drives Visual Studio Code: its own package, and a browser's remote control.
driver() {
    cd editors/vscode/e2e
    [ node_modules/.stamp -nt package-lock.json ] && return
    npm ci --no-audit --no-fund --loglevel=error
    cd node_modules/code-server/lib/vscode
    npm install --ignore-scripts --omit=dev --no-audit --no-fund --loglevel=error
    # Terminals need a native module; without a compiler their tests are skipped.
    npm rebuild --ignore-scripts=false node-pty >/dev/null 2>&1 || true
    touch ../../../.stamp
}

since=$(date +%s)
status=0
missing=
[ -n "$(browser)" ] || missing="$missing chromium"
have nvim || missing="$missing neovim"
have emacs || missing="$missing emacs-nox elpa-eglot"
have vim || missing="$missing vim"
have npm || missing="$missing npm"
installing=
if [ -n "$missing" ] && [ "${INSTALL:-}" = 1 ]; then
    if have apt-get && [ "$(id -u)" = 0 ]; then
        # shellcheck disable=SC2086
        install $missing &
        installing=$!
        have npm || wait "$installing" # else it goes on beside what npm gets
    else
        note "not installed, as that takes apt-get and the user root:$missing"
    fi
fi
if ! new_node; then
    if have npm; then why="Node.js is older than 20"; else why="npm cannot be had here"; fi
    note "SKIPPED: Visual Studio Code is not tested, because $why"
else
    make vsix
    seconds "the extension"
    if [ -n "$(browser)" ] || [ -n "$installing" ]; then
        (driver)
        seconds "Visual Studio Code"
    fi
fi
if [ -n "$installing" ]; then
    wait "$installing" || true
    seconds "more for the system's packages"
fi
if new_node; then
    if [ -z "$(browser)" ]; then
        note "SKIPPED: Visual Studio Code is not tested, because Chromium cannot be had here"
    else
        (cd editors/vscode/e2e && node run.mjs "$(browser)") || status=1
        seconds "the tests in Visual Studio Code"
    fi
fi
for editor in nvim emacs vim; do
    have "$editor" || note "SKIPPED: $editor is not tested, because it cannot be had here"
done
.venv/bin/python -m pytest tests/editors -rs || status=1
seconds "the tests in other editors"
exit $status
