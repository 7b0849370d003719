#!/bin/sh
# Make .venv, or bring it up to date: `sh tools/venv.sh dev` installs this checkout, editable, with its extra `dev`.
# A stamp, written last, says for which checkout, pyproject.toml and script; a moved, copied or half-made .venv is made
# anew.
set -eu
extras=$1
cd "$(dirname "$0")/.."
here=$(pwd)
current="$here $(cat pyproject.toml tools/venv.sh | cksum)"

clear=--clear
if [ -x .venv/bin/python ]; then
    # bench (peers of the benchmarks), wheels (the cross compiler) and docs, which holds wheels, hold dev; dev the rest.
    case "$extras" in
    bench | docs) more= ;;
    wheels) more=.venv/with-docs ;;
    *) more=".venv/with-dev .venv/with-bench .venv/with-wheels .venv/with-docs" ;;
    esac
    for stamp in ".venv/with-$extras" $more; do
        case "$(cat "$stamp" 2>/dev/null)" in
        "$current") exit 0 ;;
        "$here "*) clear= ;;
        esac
    done
fi

python=$(sh tools/find_python.sh)
echo "setting up .venv with hopform[$extras] ..."
[ -z "$clear" ] || "$python" -m venv --clear .venv
# The library is for tools/build_library.py: it stops at an error, which here would hide in pip's output.
HOPFORM_REQUIRE_C='' .venv/bin/python -m pip install --quiet --disable-pip-version-check --editable ".[$extras]"
case "$extras" in
dev | bench | wheels | docs) # without what it requires, which is for modes that tests/mutation does not use
    .venv/bin/python -m pip install --quiet --disable-pip-version-check --no-deps universalmutator==1.14.1
    ;;
esac
echo "$current" >".venv/with-$extras"
