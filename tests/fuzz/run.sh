#!/bin/sh
# Fuzz each C entry point, or those of ENTRIES, for SECONDS_EACH (default 60), in both precisions, JOBS (default:
# processors) at a time, by FUZZ_SEED (default: another each time). A finding stops it, unless KEEP_GOING is set, and
# stays in out/fuzz; tests/fuzz/found holds earlier ones, which are tried first.
set -eu
cd "$(dirname "$0")/../.."
clang=${CLANG:-clang}
seconds=${SECONDS_EACH:-60}
checks="-fsanitize=fuzzer-no-link,address,undefined -fno-sanitize-recover=all"
flags="-std=c99 -g -O1 -ffp-contract=off -D_GNU_SOURCE -Igenerated/c/include"

if [ $# -eq 2 ]; then # one entry point in one precision
    name=fuzz_$1_$2
    target=tests/fuzz/fuzz_entry.c
    [ ! -f "tests/fuzz/fuzz_$1.c" ] || target=tests/fuzz/fuzz_$1.c
    # shellcheck disable=SC2086
    "$clang" $flags $checks -fsanitize=fuzzer -D"$2" -DENTRY="$1" "$target" out/fuzz/objects/*.o -o "out/fuzz/$name" -lm
    mkdir -p "out/fuzz/corpus_$name"
    status=0
    "out/fuzz/$name" -max_total_time="$seconds" -seed="${FUZZ_SEED:-0}" -max_len=256 -timeout=10 -verbosity=0 \
        -print_final_stats=1 \
        -artifact_prefix="out/fuzz/${name}_" "out/fuzz/corpus_$name" tests/fuzz/found \
        2>"out/fuzz/$name.log" || status=$?
    runs=$(sed -n 's/^stat::number_of_executed_units: *//p' "out/fuzz/$name.log")
    slowest=$(sed -n 's/^stat::slowest_unit_time_sec: *//p' "out/fuzz/$name.log")
    echo "entry $1, $2: ${runs:-?} inputs in $seconds s, slowest ${slowest:-?} s"
    [ "$status" -eq 0 ] && exit 0
    echo "a finding: out/fuzz/$name.log" >&2
    grep -m 3 -e 'runtime error' -e 'ERROR' -e 'Test unit' "out/fuzz/$name.log" >&2
    exit "$([ -n "${KEEP_GOING:-}" ] && echo 1 || echo 255)" # 255: no more are begun
fi

if ! command -v "$clang" >/dev/null; then
    echo "hopform: no clang: $clang not found (set CLANG, or on Debian: apt install clang)" >&2
    exit 1
fi
rm -rf out/fuzz/objects
mkdir -p out/fuzz/objects
jobs=${JOBS:-$(getconf _NPROCESSORS_ONLN)}
for source in generated/c/src/*.c; do
    case $source in
    *_of_many_*) continue ;;
    *) more=float-divide-by-zero,float-cast-overflow ;;
    esac
    echo "$source out/fuzz/objects/$(basename "$source" .c).o $more"
done | sort -r | xargs -n 3 -P "$jobs" sh -c "$clang $flags $checks -fsanitize=\$2 -c \"\$0\" -o \"\$1\""
for precision in DOUBLE SINGLE; do
    for entry in ${ENTRIES:-1 2 3 4 flight control reading plant batch}; do
        echo "$entry $precision"
    done
done | SECONDS_EACH=$seconds xargs -n 2 -P "$jobs" sh tests/fuzz/run.sh
