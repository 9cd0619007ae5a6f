"""The real service and a headless Chromium for the page's tests."""

import base64
import json
import os
import pathlib
import re
import shutil
import struct
import subprocess
import tempfile
import time
import unittest
import zlib

from selenium import webdriver
from selenium.webdriver.chrome.options import Options
from selenium.webdriver.chrome.service import Service

OUT = pathlib.Path(os.environ.get("PENUMBRA_OUT", "."))
EXAMPLES = pathlib.Path(os.environ["PENUMBRA_EXAMPLES"])
WAIT_S = 120  # for one mask: a trace of 1280 x 720 takes half a minute on two cores that do other things too


def png_bytes(width, height, colour):
    """An 8-bit RGB PNG of colour(x, y)."""
    rows = b"".join(b"\0" + bytes(value for x in range(width) for value in colour(x, y)) for y in range(height))
    chunk = lambda name, data: struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))
    head = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")


def exr_bytes(width, height, parts):
    """An uncompressed EXR of float32: parts is [(name, {channel: value})], each channel of one value all over."""
    several = len(parts) > 1

    def attribute(name, kind, data):
        return f"{name}\0{kind}\0".encode() + struct.pack("<i", len(data)) + data

    headers, chunks = [], []
    for number, (name, channels) in enumerate(parts):
        ordered = sorted(channels)
        listed = b"".join(one.encode() + b"\0" + struct.pack("<iB3xii", 2, 0, 1, 1) for one in ordered) + b"\0"
        window = struct.pack("<4i", 0, 0, width - 1, height - 1)
        header = (attribute("channels", "chlist", listed) + attribute("compression", "compression", b"\0") + attribute("dataWindow", "box2i", window)
                  + attribute("displayWindow", "box2i", window) + attribute("lineOrder", "lineOrder", b"\0")
                  + attribute("pixelAspectRatio", "float", struct.pack("<f", 1)) + attribute("screenWindowCenter", "v2f", struct.pack("<2f", 0, 0))
                  + attribute("screenWindowWidth", "float", struct.pack("<f", 1)))
        if several:
            header += (attribute("name", "string", name.encode()) + attribute("type", "string", b"scanlineimage")
                       + attribute("chunkCount", "int", struct.pack("<i", height)))
        headers.append(header + b"\0")
        row = b"".join(struct.pack("<f", channels[one]) * width for one in ordered)
        chunks += [(struct.pack("<i", number) if several else b"") + struct.pack("<ii", y, len(row)) + row for y in range(height)]
    head = struct.pack("<ii", 20000630, 2 | (0x1000 if several else 0)) + b"".join(headers) + (b"\0" if several else b"")
    at, offsets = len(head) + 8 * len(chunks), []
    for chunk in chunks:
        offsets.append(at)
        at += len(chunk)
    return head + struct.pack(f"<{len(offsets)}Q", *offsets) + b"".join(chunks)


class Server:
    """penumbra-server on a free port, or on that one; PENUMBRA_URL names one that runs already."""

    def __init__(self, port=0, **environment):
        self.process = None
        self.url = os.environ.get("PENUMBRA_URL", "")
        if self.url and not environment and port == 0:
            return
        self.process = subprocess.Popen(
            [os.environ["PENUMBRA_SERVER"], "--port", str(port)],
            env={**os.environ, **environment},
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
        )
        said = []
        for line in self.process.stderr:
            said.append(line)
            listening = re.search(r"listening on (\S+) port (\d+)", line)
            if listening:
                self.url = f"http://127.0.0.1:{listening[2]}"
            if line.strip() == "ready":
                break
        else:
            raise RuntimeError("the service ended at its start: " + "".join(said))
        # What it logs from here on must not fill the pipe.
        self.drain = subprocess.Popen(["cat"], stdin=self.process.stderr, stdout=subprocess.DEVNULL)

    def stop(self):
        if self.process:
            self.process.terminate()
            self.process.wait(30)
            self.drain.wait(5)
            self.process.stderr.close()
            self.process = None


def chromium():
    options = Options()
    options.binary_location = os.environ.get("PENUMBRA_CHROMIUM", "/usr/bin/chromium")
    for flag in ("--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--no-proxy-server"):
        options.add_argument(flag)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
    driver = os.environ.get("PENUMBRA_CHROMEDRIVER", "/usr/bin/chromedriver")
    return webdriver.Chrome(service=Service(driver), options=options)


class PageTest(unittest.TestCase):
    """One service and one browser for all tests of a class; each test opens the page anew."""

    opens = True

    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="penumbra_web_"))
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        cls.server = Server()
        cls.addClassCleanup(cls.server.stop)
        cls.browser = chromium()
        cls.addClassCleanup(cls.browser.quit)
        cls.browser.set_script_timeout(WAIT_S)

    def setUp(self):
        self.open(self.server)

    def open(self, server):
        """The page, with its first mask in full: on a slow machine another technique's stands in before."""
        self.resize(1440, 960)
        self.browser.get(server.url + "/")
        self.wait_for("const d = document.getElementById('mask').dataset; "
                      "return d.version && d.version === d.asked && document.getElementById('name_a').hidden")

    # The page's console holds no errors but those that a test expects and takes itself.
    def tearDown(self):
        self.assertEqual(self.console_errors(), [])

    def js(self, script, *arguments):
        return self.browser.execute_script(script, *arguments)

    def module(self, script, *arguments):
        """Runs an async function body in which `page(NAME)` imports a module of the page."""
        result = self.browser.execute_async_script(
            """
            const done = arguments[arguments.length - 1], given = [...arguments].slice(0, -1);
            const page = (name) => import(`/page/${name}.js`);
            (async (...given) => {"""
            + script
            + """})(...given).then((value) => done({value}), (error) => done({error: String(error)}));""",
            *arguments,
        )
        self.assertNotIn("error", result)
        return result["value"]

    def wait_for(self, script, *arguments):
        end = time.monotonic() + WAIT_S
        while time.monotonic() < end:
            value = self.js(script, *arguments)
            if value:
                return value
            time.sleep(0.03)
        self.fail(f"nothing came of {script!r} in {WAIT_S} s; the page says: {self.problem()!r}")

    def settled(self):
        """Waits until the state as it is has a mask, or the service's word why not: that version."""
        return self.wait_for("const d = document.getElementById('mask').dataset, last = Math.max(Number(d.version), Number(d.refused ?? -1)); "
                             "return last === Number(d.asked) && last")

    def problem(self):
        return self.js("const box = document.getElementById('problem'); return box.hidden ? '' : box.textContent")

    def record(self, name):
        """From now on, each text of this element: what stands for a moment only is missed by who looks now and then. `said` gives them."""
        self.js(
            """
            const node = document.getElementById(arguments[0]), texts = [];
            window.said = {...window.said, [arguments[0]]: texts};
            new MutationObserver(() => {
                const text = node.hidden ? "" : node.textContent;
                if (texts.at(-1) !== text) texts.push(text);
            }).observe(node, {childList: true, characterData: true, subtree: true, attributes: true, attributeFilter: ["hidden"]});
            """,
            name,
        )

    def said(self, name):
        return self.js("return window.said[arguments[0]]", name)

    def wait_until_said(self, name, pattern):
        self.wait_for("return window.said[arguments[0]].some((text) => new RegExp(`^${arguments[1]}$`).test(text))", name, pattern)

    def version(self):
        return int(self.js("return document.getElementById('mask').dataset.version"))

    def change(self, action):
        """Does what changes the mask, and waits for the new one."""
        before = self.version()
        action()
        self.wait_for("return Number(document.getElementById('mask').dataset.version) > arguments[0]", before)

    def mask(self):
        """The canvas: [width, height], a digest of its pixels, their darkest, lightest, and share of values between."""
        return self.js(
            """
            const canvas = document.getElementById("mask");
            const {data} = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
            let digest = 0, low = 255, high = 0, between = 0, coloured = 0;
            for (let i = 0; i < data.length; i += 4) {
                digest = (Math.imul(digest, 31) + data[i] + 7 * data[i + 2]) | 0;
                low = Math.min(low, data[i]);
                high = Math.max(high, data[i]);
                if (data[i] > 5 && data[i] < 250) between++;
                if (data[i] !== data[i + 2]) coloured++;
            }
            const pixels = data.length / 4;
            return {size: [canvas.width, canvas.height], digest, low, high, between: between / pixels, coloured: coloured / pixels};
            """
        )

    def resize(self, width, height, dark=False):
        self.browser.execute_cdp_cmd(
            "Emulation.setDeviceMetricsOverride", {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False}
        )
        scheme = {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}
        self.browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": [scheme]})

    def screenshot(self, name):
        time.sleep(0.3)  # for the observers of sizes and of the colour scheme
        self.browser.save_screenshot(str(OUT / name))

    def console_errors(self):
        return [entry["message"] for entry in self.browser.get_log("browser") if entry["level"] == "SEVERE"]

    def requests(self):
        """Addresses asked for since the last call."""
        messages = [json.loads(entry["message"])["message"] for entry in self.browser.get_log("performance")]
        return [m["params"]["request"]["url"] for m in messages if m["method"] == "Network.requestWillBeSent"]

    def penumbra(self, *arguments):
        run = subprocess.run([os.environ["PENUMBRA_CLI"], *map(str, arguments)], capture_output=True, text=True)
        self.assertEqual(run.returncode, 0, run.stderr)
        return run.stdout

    def drop(self, *paths):
        """Drops files on the mask, as a file manager does."""
        files = [[path.name, base64.b64encode(path.read_bytes()).decode()] for path in paths]
        self.js(
            """
            const transfer = new DataTransfer();
            for (const [name, text] of arguments[0])
                transfer.items.add(new File([Uint8Array.from(atob(text), (c) => c.charCodeAt(0))], name));
            const frame = document.getElementById("frame");
            for (const type of ["dragover", "drop"])
                frame.dispatchEvent(new DragEvent(type, {dataTransfer: transfer, bubbles: true, cancelable: true}));
            """,
            files,
        )
