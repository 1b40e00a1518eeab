#!/usr/bin/env python3
"""Looks at the plots of a report in Chromium: plot_test.py HIL SCENARIO

At the width of a desk and of a phone: no text over another one or beyond its card, no plot without its
lines, no page wider than its window; values at the pointer as in signals.csv; zoom by buttons and by
dragging; SVG files that Chromium draws.
"""
import base64
import csv
import html
import json
import pathlib
import re
import subprocess
import sys
import tempfile

WIDTHS = [1000, 390]
HERE = pathlib.Path(__file__).parent


def probe_page(report, pictures):
    """A page with the report in a frame, and the probe."""
    sources = {}
    for picture in pictures:
        data = base64.b64encode(picture.read_bytes()).decode()
        sources[picture.name] = "data:image/svg+xml;base64," + data
    return f"""<!DOCTYPE html><meta charset="utf-8"><pre id="result"></pre>
<iframe style="border:0;height:6000px" srcdoc="{html.escape(report)}"></iframe>
<script>{(HERE / "probe.js").read_text()}
const print = text => document.getElementById('result').textContent = text;
window.onload = () => probe({WIDTHS}, {json.dumps(sources)})
    .catch(error => ({{faults: [String(error)]}}))
    .then(result => print(JSON.stringify(result)));
</script>"""


def look(page, folder):
    """What the probe found. Chromium ends when its virtual time is over."""
    file = folder / "probe.html"
    file.write_text(page)
    dom = subprocess.run(
        ["chromium", "--headless", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage",
         f"--user-data-dir={folder / 'profile'}", "--window-size=1200,1000", "--virtual-time-budget=60000",
         "--dump-dom", file.as_uri()], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True,
        timeout=240, check=True).stdout
    text = html.unescape(re.search(r'<pre id="result">(.*?)</pre>', dom, re.S).group(1))
    return json.loads(text) if text else {"faults": ["the probe did not end"]}


def logged(folder, signal, time_s):
    with open(folder / "signals.csv", newline="") as file:
        for row in csv.DictReader(file):
            if float(row["time_s"]) >= time_s:
                return float(row[signal])
    raise SystemExit(f"signals.csv has no value of {signal} at {time_s} s")


def main():
    hil, scenario = sys.argv[1:]
    faults = []

    def check(condition, sentence):
        if not condition:
            faults.append(sentence)

    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        subprocess.run([hil, "run", scenario, "--out", folder], stdout=subprocess.DEVNULL, check=False)
        pictures = sorted((folder / "pictures").glob("*.svg"))
        record = json.loads((folder / "report.json").read_text())["signal_plots"]
        result = look(probe_page((folder / "report.html").read_text(), pictures), folder)
        faults += result["faults"]
        check(len(pictures) == len(record["plots"]),
              f"{len(pictures)} SVG files of {len(record['plots'])} plots")
        for picture, ink in result.get("ink", {}).items():
            check(ink > 0.005, f"{picture} is empty: {ink}")
        check(len(result.get("ink", {})) == len(pictures), "Chromium did not draw all SVG files")

        for width in WIDTHS:
            plots = result.get("plots", {}).get(str(width), [])
            check(len(plots) == len(record["plots"]), f"{width} px: {len(plots)} plots")
            if not plots:
                continue
            first = plots[0]  # of the failed expectation, over the whole run of 10 s
            check(first["clock"].startswith("5.0"), f"the time at the pointer is {first['clock']}")
            shown = [float(value) for value in first["values"][0].split(" … ")]  # of a bucket of ticks
            true = logged(folder, "machine.speed", 5.0)
            check(shown[0] - 0.02 <= true <= shown[-1] + 0.02,
                  f"the value at the pointer is {shown}, not {true}")
            check(first["labels"][0] == "0 s" and first["labels"][-1] == "10 s", f"labels {first['labels']}")
            check(first["zoomed_labels"][0] >= "3.7" and first["zoomed_labels"][-1] <= "6.3 s",
                  f"zoomed labels {first['zoomed_labels']}")
            check(float(first["dragged_labels"][0].split()[0]) >= 2.5
                  and float(first["dragged_labels"][-1].split()[0]) <= 7.5,
                  f"labels after dragging {first['dragged_labels']}")
            texts = [text for plot in plots for text in plot["texts"]]
            for text in ["labels are distances from 5 m", "values beyond 1e100 are cut"]:
                check(texts.count(text) == 1, f"'{text}' is there {texts.count(text)} times")
            check(texts.count("test table checks") == len(plots), "not each plot has one lane of the table")
            expected = [plot["expected"] for plot in plots]
            check(sum(expected) == 3, f"values of the test table: {expected}")
            dots = [plot["dots"] for plot in plots]
            check(sum(dots) == 1, f"dots of lines that are too short: {dots}")
            close = next(plot for plot in plots if "labels are distances from 5 m" in plot["texts"])
            value = float(close["values"][0])
            check(abs(value - 5.0 + 0.96e-9) < 0.02e-9, f"the value at the pointer is {value}")
            named = plots[1]["values"]  # of the plot of the scenario
            check("driving" in named and "0" in named, f"the values of steps are {named}")
    for fault in faults:
        print(fault)
    sys.exit(1 if faults else 0)


main()
