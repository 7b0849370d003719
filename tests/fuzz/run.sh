#!/bin/sh
# Fuzz each C entry point for SECONDS (default 60), in both precisions; a finding stops it and stays in out/fuzz; tests/fuzz/found holds earlier ones.
set -eu
cd "$(dirname "$0")/../.."
clang=${CLANG:-clang}
command -v "$clang" >/dev/null || { echo "hopform: no clang: $clang not found (set CLANG, or on Debian: apt install clang)" >&2; exit 1; }
mkdir -p out/fuzz
for precision in DOUBLE SINGLE; do
    for entry in 1 2 3 4 flight; do
        name=fuzz_${entry}_$precision
        target=tests/fuzz/fuzz_entry.c
        [ "$entry" != flight ] || target=tests/fuzz/fuzz_flight.c
        "$clang" -std=c99 -g -O1 -ffp-contract=off -D_GNU_SOURCE -D"$precision" -DENTRY="$entry" -Igenerated/c/include \
            -fsanitize=fuzzer,address,undefined,float-divide-by-zero,float-cast-overflow -fno-sanitize-recover=all \
            "$target" generated/c/src/*.c -o "out/fuzz/$name" -lm
        mkdir -p "out/fuzz/corpus_$name"
        echo "entry $entry, $precision: ${SECONDS_EACH:-60} s"
        "out/fuzz/$name" -max_total_time="${SECONDS_EACH:-60}" -max_len=256 -timeout=10 -verbosity=0 \
            -print_final_stats=1 -artifact_prefix="out/fuzz/${name}_" "out/fuzz/corpus_$name" tests/fuzz/found 2>"out/fuzz/$name.log" || {
            echo "a finding: out/fuzz/$name.log" >&2
            grep -m 3 -e 'runtime error' -e 'ERROR' -e 'Test unit' "out/fuzz/$name.log" >&2
            [ -n "${KEEP_GOING:-}" ] || exit 1
        }
    done
done
