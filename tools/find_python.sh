#!/bin/sh
# Print a Python that can make .venv: $PYTHON if set, else the first of the usual names that is new enough and has venv.
# Names are tried by running them: a pyenv shim may stand on PATH for a Python that is not there.
if [ "${PYTHON:-}" ]; then
    set -- "$PYTHON"
else
    set -- python3 python3.14 python3.13 python3.12 python3.11 /usr/bin/python3
fi
bare=
for python; do
    "$python" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null || continue
    if "$python" -c 'import ensurepip, venv' 2>/dev/null; then
        echo "$python"
        exit 0
    fi
    bare=${bare:-$python}
done
if [ "$bare" ]; then
    echo "hopform: $bare cannot make a venv (on Debian: apt install python3-venv)" >&2
else
    echo "hopform: none of [$*] is Python 3.11 or newer (on Debian 12 or newer: apt install python3 python3-venv)" >&2
fi
exit 1
