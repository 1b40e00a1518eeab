#!/usr/bin/env python3
"""transcript_test.py HIL README: the first scenario of README runs, and its console output is right.

Saves README's first block of YAML as first.yaml, runs each `$` command of its blocks of text, and compares
what the command prints. Times in "N ticks in TIME" differ from machine to machine and are not compared.
"""

import pathlib
import re
import subprocess
import sys
import tempfile


def blocks(text, language):
    return re.findall(rf"^```{language}\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)


def steps(block):
    """Pairs of command and output."""
    for part in re.split(r"^\$ ", block.replace("\\\n", ""), flags=re.MULTILINE)[1:]:
        command, _, output = part.partition("\n")
        yield command, output


def without_times(output):
    return re.sub(r"(ticks in )[\d.]+ \w+", r"\1TIME", output)


def main(hil, readme):
    hil = pathlib.Path(hil).resolve()
    text = pathlib.Path(readme).read_text(encoding="utf-8")
    transcripts = [step for block in blocks(text, "text") for step in steps(block)]
    wrong = [] if transcripts else ["the README has no block of text with a `$` command"]
    with tempfile.TemporaryDirectory() as folder:
        (pathlib.Path(folder) / "first.yaml").write_text(blocks(text, "yaml")[0], encoding="utf-8")
        status = 0
        for command, expected in transcripts:
            if command == "echo $?":
                printed = f"{status}\n"
            else:
                done = subprocess.run(["sh", "-c", re.sub(r"^hil ", f"'{hil}' ", command)], cwd=folder,
                                      capture_output=True, text=True)
                status = done.returncode
                # The README shows a terminal, on which this line is not printed.
                errors = [line for line in done.stderr.splitlines(True) if "the run begins: " not in line]
                printed = done.stdout + "".join(errors)
            if without_times(printed) != without_times(expected):
                wrong.append(f"$ {command}\n--- the README has\n{expected}--- the program prints\n{printed}")
    print("\n".join(wrong) or f"{len(transcripts)} commands print what the README has")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
