#!/bin/sh
# What the firmware tests take, from Debian or Ubuntu; nothing where all of it is there.
set -eu
missing=""
want() { command -v "$1" >/dev/null || missing="$missing $2"; }
want arm-none-eabi-gcc "gcc-arm-none-eabi libnewlib-arm-none-eabi"
want riscv64-unknown-elf-gcc "gcc-riscv64-unknown-elf picolibc-riscv64-unknown-elf"
want qemu-system-arm qemu-system-arm
want qemu-system-riscv32 qemu-system-misc
want clang clang
want cmake cmake
want c++ g++
want cppcheck cppcheck
[ -n "$missing" ] || exit 0
root=""
[ "$(id -u)" = 0 ] || root=sudo
$root apt-get update -qq
# shellcheck disable=SC2086
$root env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends $missing >/dev/null
