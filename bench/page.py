#!/usr/bin/env python3
"""How fast the page is: updates a second while the light moves, and the time to the first mask of a dropped depth pass. A table on standard output.

    bench/page.py          about a minute; needs a build as bench/run.sh does, and what tests/web needs: chromium, chromedriver, python3-selenium

PENUMBRA_SERVER, PENUMBRA_CLI: other programs. BENCH_SECONDS: of each measurement of a rate (5).
"""
import json
import os
import pathlib
import sys
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent
BUILD = ROOT / "build" / "release"
os.environ.setdefault("PENUMBRA_SERVER", str(BUILD / "server" / "penumbra-server"))
os.environ.setdefault("PENUMBRA_CLI", str(BUILD / "clients" / "cli" / "penumbra"))
os.environ.setdefault("PENUMBRA_EXAMPLES", str(ROOT / "examples"))
sys.path.insert(0, str(ROOT / "tests" / "web"))
import browser  # noqa: E402
from browser import PageTest  # noqa: E402

browser.WAIT_S = 120

SECONDS = float(os.environ.get("BENCH_SECONDS", 5))
WATCH = """
addEventListener("drop", () => (window.dropped = performance.now()), {capture: true, once: true});
const mask = document.getElementById("mask");
window.came = [];
window.watcher?.disconnect();
window.watcher = new MutationObserver(() => window.came.push(performance.now()));
window.watcher.observe(mask, {attributes: true, attributeFilter: ["data-version"]});
"""


class Bench(PageTest):
    """The page's own tests have what opens it and drops files."""

    def runTest(self):
        self.row("scene", "mask", "first mask, s", "in full, s", "updates a second", "load")
        self.row(*["---"] * 6)
        self.row("courtyard", "512 x 512", "", "", self.rate(), self.load())
        for width, height in ((1280, 720), (2048, 2048)):
            path = self.pass_of(width, height)
            # What was there before is there in full.
            self.wait_for("return document.getElementById('busy').hidden && !document.getElementById('name_a').textContent.includes('draft')")
            self.js(WATCH)
            self.change(lambda: self.drop(path))
            self.wait_for("return document.getElementById('mask').dataset.technique === 'depth_trace' || !document.getElementById('problem').hidden")
            first, full = self.js("return [window.came[0], performance.now()].map((ms) => (ms - window.dropped) / 1000)")
            self.row("one camera's depth", f"{width} x {height}", f"{first:.1f}", f"none: {self.problem()}" if self.problem() else f"{full:.1f}", self.rate(), self.load())

    def pass_of(self, width, height):
        """A depth pass of that size, rendered from the example's scene."""
        scene = json.loads((ROOT / "examples" / "04_relight_depth_view.json").read_text())
        scene["receivers"]["resolution"] = [width, height]
        (self.folder / "scene.json").write_text(json.dumps(scene))
        out = self.folder / f"{width}"
        self.penumbra("depth", self.folder / "scene.json", "--out", out)
        return out / "receiver.exr"

    def rate(self):
        """Masks that came while the light moved with every frame of the browser."""
        self.js("document.getElementById('orbit').click()")
        time.sleep(1)
        self.js(WATCH)
        time.sleep(SECONDS)
        came = self.js("return window.came")
        self.js("document.getElementById('orbit').click()")
        return f"{(len(came) - 1) / (came[-1] - came[0]) * 1000:.1f}" if len(came) > 1 else "none"

    @staticmethod
    def load():
        return f"{os.getloadavg()[0]:.1f} on {os.cpu_count()} cores"

    @staticmethod
    def row(*cells):
        print("| " + " | ".join(cells) + " |", flush=True)


if __name__ == "__main__":
    Bench.setUpClass()
    try:
        bench = Bench()
        bench.setUp()
        bench.runTest()
    finally:
        Bench.doClassCleanups()
