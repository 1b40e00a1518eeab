#!/usr/bin/env bash
# install_refuses.sh INSTALL: without a purpose, or with one that nothing is for, it exits with 64 and tells the purposes.
set -uo pipefail
install=$1
for arguments in "" nonsense "run nonsense"; do
  # shellcheck disable=SC2086
  said=$("$install" $arguments 2>&1)
  code=$?
  [[ $code -eq 64 && $said == *"urposes: "*run* ]] && continue
  echo "tools/install $arguments: exits with $code, says '$said'" >&2
  exit 1
done
