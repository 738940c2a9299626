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

missing=
[ -n "$(browser)" ] || missing="$missing chromium"
have nvim || missing="$missing neovim"
have emacs || missing="$missing emacs-nox elpa-eglot"
have vim || missing="$missing vim"
have npm || missing="$missing npm"
if [ -n "$missing" ] && [ "${INSTALL:-}" = 1 ] && have apt-get && [ "$(id -u)" = 0 ]; then
    export DEBIAN_FRONTEND=noninteractive
    # shellcheck disable=SC2086
    { timeout 120 apt-get update -qq && timeout 400 apt-get install -y -qq --no-install-recommends $missing; } >/dev/null \
        || note "not all of$missing could be installed"
fi

status=0
if ! have npm; then
    note "SKIPPED: Visual Studio Code is not tested, because npm cannot be had here"
else
    make vsix
    if [ -z "$(browser)" ]; then
        note "SKIPPED: Visual Studio Code is not tested, because Chromium cannot be had here"
    else
        cd editors/vscode/e2e
        if ! [ node_modules/.stamp -nt package-lock.json ]; then
            npm ci --no-audit --no-fund --loglevel=error
            inner=node_modules/code-server/lib/vscode
            (cd $inner && npm install --ignore-scripts --omit=dev --no-audit --no-fund --loglevel=error)
            # Terminals need a native module; without a compiler their tests are skipped.
            (cd $inner && npm rebuild --ignore-scripts=false node-pty >/dev/null 2>&1) || true
            touch node_modules/.stamp
        fi
        node run.mjs "$(browser)" || status=1
        cd ../../..
    fi
fi
.venv/bin/python -m pytest tests/editors -rs || status=1
exit $status
