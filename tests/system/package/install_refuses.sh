#!/usr/bin/env bash
# install_refuses.sh INSTALL: without a purpose, or with an unknown one, it exits with 64 and lists the purposes.
set -uo pipefail
install=$1
for arguments in "" nonsense "run nonsense"; do
  # shellcheck disable=SC2086
  output=$("$install" $arguments 2>&1)
  code=$?
  [[ $code -eq 64 && $output == *"urposes: "*run* ]] && continue
  echo "tools/install $arguments: exits with $code, prints '$output'" >&2
  exit 1
done
