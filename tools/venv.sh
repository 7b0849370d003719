#!/bin/sh
# Make .venv, or bring it up to date, for what targets of the Makefile need: `sh tools/venv.sh dev`.
#
# run: this checkout, editable, with the extras below. Any other name is a dependency group of pyproject.toml beside
# that. A group names this checkout for its extras alone: it is there, so pip leaves it, and .venv stays usable.
# A stamp, written last, says for which checkout, pyproject.toml, script and version (derive/__init__.py), which is
# installed with the checkout; a moved, copied or half-made .venv is made anew.
set -eu
wanted=$1
extras=derive,identify,plot
cd "$(dirname "$0")/.."
here=$(pwd)
current="$here $(cat pyproject.toml tools/venv.sh derive/__init__.py | cksum)"

case "$wanted" in # what is there with it
run) holds="run" ;;
docs | zig) holds="run $wanted" ;;
dev) holds="run dev" ;;
site) holds="run dev docs site" ;;
*) holds="run dev $wanted" ;;
esac

is_current() { [ -x .venv/bin/python ] && [ "$(cat ".venv/with-$1" 2>/dev/null)" = "$current" ]; }
is_current "$wanted" && exit 0

clear=--clear
if [ -x .venv/bin/python ]; then
    for stamp in .venv/with-*; do
        case "$(cat "$stamp" 2>/dev/null)" in "$here "*) clear= ;; esac
    done
fi

python=$(sh tools/find_python.sh)
echo "setting up .venv for $wanted ..."
[ -z "$clear" ] || "$python" -m venv --clear .venv
install() { .venv/bin/python -m pip install --quiet --disable-pip-version-check "$@"; }
# The library is for tools/build_library.py, whose errors would hide in pip's output here.
is_current run || HOPFORM_COMPILE_LATER=1 install --editable ".[$extras]"
echo "$current" >.venv/with-run
if [ "$wanted" != run ]; then
    .venv/bin/python -m pip install --help | grep -q -e --group || install 'pip>=25.1'
    install --group "$wanted"
fi
case "$holds" in *dev*) # without what it requires, which is for modes that tests/mutation does not use
    install --no-deps universalmutator==1.14.1
    ;;
esac
for each in $holds; do echo "$current" >".venv/with-$each"; done
