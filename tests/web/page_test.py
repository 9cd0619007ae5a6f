"""The page as its user has it: open it, move the light, compare, drop depth maps and pictures."""

import base64
import json
import re
import time
import unittest

from browser import EXAMPLES, WAIT_S, PageTest, Server, exr_bytes, png_bytes
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.support.ui import Select


class Page(PageTest):
    def find(self, selector):
        return self.browser.find_element(By.CSS_SELECTOR, selector)

    def view(self, mode):
        self.js("document.querySelector(`[name=mode][value=${arguments[0]}]`).click()", mode)

    def wait_for_b(self):
        self.wait_for("const d = document.getElementById('mask').dataset; return d.versionB && d.versionB === d.version && d.versionB === d.asked")

    def assert_shadowed(self, mask):
        self.assertLess(mask["low"], 30)
        self.assertGreater(mask["high"], 250)
        self.assertGreater(mask["between"], 0.005)

    def test_opens_with_the_bundled_scene_shadowed(self):
        mask = self.mask()
        self.assertEqual(mask["size"], [512, 512])
        self.assert_shadowed(mask)
        self.assertEqual(self.problem(), "")
        self.wait_for("return document.getElementById('figures').textContent.includes('shade')")
        self.screenshot("page_light.png")
        self.resize(1440, 960, dark=True)
        self.screenshot("page_dark.png")

    def test_the_light_moves_by_keyboard(self):
        pad = self.find("#light_pad")
        seen = [self.mask()["digest"]]
        for key in (Keys.ARROW_RIGHT, Keys.ARROW_DOWN, Keys.PAGE_UP, Keys.SHIFT + Keys.ARROW_LEFT):
            self.change(lambda: pad.send_keys(key))
            seen.append(self.mask()["digest"])
        self.assertEqual(len(set(seen)), len(seen), "each step changes the mask")
        self.assertIn("Light from above, at x", pad.get_attribute("aria-label"))

    def test_the_light_moves_by_dragging(self):
        pad = self.find("#light_pad")
        before = self.mask()
        self.change(lambda: ActionChains(self.browser, duration=50).move_to_element_with_offset(pad, -40, 60).click_and_hold()
                    .move_by_offset(50, -20).move_by_offset(60, 30).release().perform())
        time.sleep(0.3)
        after = self.mask()
        self.assertNotEqual(before["digest"], after["digest"])
        self.assert_shadowed(after)

    def set_number(self, selector, value):
        self.js("const c = document.querySelector(arguments[0]); c.value = arguments[1]; c.dispatchEvent(new Event('input'))", selector, value)

    def test_every_kind_and_size_of_light(self):
        self.change(lambda: Select(self.find("#technique_a [name=kind]")).select_by_value("ray_traced"))
        self.change(lambda: self.set_number("#technique_a [name=samples]", 4))
        sizes = {"directional": ["angular_diameter_deg"], "sphere": ["radius"], "point": [], "rectangle": ["width", "length"]}
        for kind, names in sizes.items():
            self.change(lambda: Select(self.find("[name=light_kind]")).select_by_value(kind))
            for name in names:
                before = self.mask()["digest"]
                self.change(lambda: self.set_number(f"[name=light_{name}]", 2.5))
                self.assertNotEqual(before, self.mask()["digest"], name)
            self.assertEqual(self.problem(), "", kind)

    def test_a_light_that_a_technique_does_not_take_is_said_so(self):
        self.change(lambda: Select(self.find("#technique_a [name=kind]")).select_by_value("soft_shadow_volume"))
        self.assertEqual(self.browser.find_elements(By.CSS_SELECTOR, "#technique_a .notice"), [])
        Select(self.find("[name=light_kind]")).select_by_value("directional")
        self.assertIn("takes no directional light", self.find("#technique_a .notice").text)
        self.wait_for("return !document.getElementById('problem').hidden")
        self.assertIn("directional", self.problem())
        self.assertTrue(all("422" in error for error in self.console_errors()))

    def test_techniques_switch_with_their_controls(self):
        before = self.mask()["digest"]
        self.change(lambda: Select(self.find("#technique_a [name=kind]")).select_by_value("ray_traced"))
        self.assertNotEqual(before, self.mask()["digest"])
        self.assertTrue(self.find("#technique_a [name=samples]").is_displayed())
        described = self.js("return fetch('/v1/techniques').then((answer) => answer.json())")["techniques"]
        listed = [option.get_attribute("value") for option in Select(self.find("#technique_a [name=kind]")).options]
        self.assertEqual(listed, [technique["kind"] for technique in described])
        for technique in described:
            self.change(lambda: Select(self.find("#technique_a [name=kind]")).select_by_value(technique["kind"]))
            names = self.js("return [...document.querySelectorAll('#technique_a [name]')].map((one) => one.name)")
            self.assertEqual(sorted(names), sorted(technique["schema"]["properties"]))

    def place_light(self, *position):
        """At once, as a drag does: three fields, of which the page asks for the last."""
        for axis, value in zip("xyz", position):
            self.set_number(f"[name=position_{axis}]", value)

    def test_the_light_goes_everywhere_and_never_ends_in_an_error(self):
        self.js("document.querySelector('#light details').open = true")
        # Through the pergola and the arch, at their middles, below the floor, on it, behind the wall, on the aim, far away, and back.
        ways = [(-1.5, 2.2, -1.2), (-1.5, 1, -1.2), (2.15, 1.9, -1.5), (0, 0.01, 0.5), (0, 0, 0.5), (0, -0.5, 0.5), (0, 2.5, -3.5), (0, 2.5, -4.5),
                (0, 0.6, -0.6), (0, -3, 20), (200, 900, -50), (1, 0.35, 1.6), (-0.6, 0.9, 2.1), (-3.4, 6.2, 4.8)]
        refused = []
        for technique in ("soft_shadow_map", "shadow_map", "soft_shadow_volume"):
            Select(self.find("#technique_a [name=kind]")).select_by_value(technique)
            for position in ways:
                self.place_light(*position)
                self.settled()
                if not self.problem():
                    continue
                refused.append((technique, position))
                # The last mask stays, greyed, and one line says why.
                self.assertTrue(self.js("return document.getElementById('problem').classList.contains('calm')"), self.problem())
                self.assertTrue(self.js("return document.getElementById('frame').classList.contains('stale')"))
                self.assertNotIn("\n", self.problem())
                self.assertGreater(self.mask()["high"], 250)
            self.assertEqual(self.problem(), "", "back where it began")
            self.assertLess(self.mask()["low"], 30)
        self.assertTrue(all("422" in error for error in self.console_errors()), refused)

    def test_a_light_in_a_caster_has_a_coarse_map_and_says_so(self):
        self.place_light(1, 0.35, 1.6)
        self.wait_for("return document.getElementById('name_a').textContent === 'soft_shadow_map with a map of 48 x 48: the light touches a caster'")
        self.settled()
        self.assertLess(self.mask()["low"], 30)
        self.place_light(-3.4, 6.2, 4.8)
        self.wait_for("return document.getElementById('name_a').hidden")
        self.assertEqual(self.mask()["size"], [512, 512])

    def test_what_is_slow_has_another_stand_in(self):
        self.hold("soft_shadow_map")
        self.set_number("[name=position_x]", 2)
        self.wait_for("return document.getElementById('mask').dataset.technique === 'soft_shadow_volume'")
        self.assertEqual(self.find("#name_a").text, "soft_shadow_volume: draft at 256 x 256; soft_shadow_map when the light rests")
        self.assertEqual(self.find("#frame").get_attribute("class"), "frame")
        # A light that moves on does not wait.
        self.change(lambda: self.set_number("[name=position_x]", 3))
        self.let_go("soft_shadow_map")
        self.wait_for("const d = document.getElementById('mask').dataset; return d.technique === 'soft_shadow_map' && d.version === d.asked")
        self.assertEqual(self.mask()["size"], [512, 512])
        self.wait_for("return document.getElementById('name_a').hidden")

    def delay(self, kind, seconds):
        """From now on the page's requests that hold this word take longer than others."""
        self.js(
            """
            const own = window.fetch, [kind, ms] = arguments;
            window.fetch = async (path, init) => {
                if (typeof init?.body === "string" && init.body.includes(`"${kind}"`)) await new Promise((then) => setTimeout(then, ms));
                return own(path, init);
            };
            """,
            kind,
            1000 * seconds,
        )

    def hold(self, text):
        """From now on the page's requests that hold this word, or text with quotes, wait until they are let go: what is seen meanwhile stays."""
        self.js(
            """
            const own = window.fetch, text = arguments[0], gate = {held: 0};
            const open = new Promise((then) => (gate.open = then));
            window.gates = {...window.gates, [text]: gate};
            window.fetch = async (path, init) => {
                if (typeof init?.body === "string" && init.body.includes(text.includes('"') ? text : `"${text}"`)) {
                    gate.held++;
                    await open;
                }
                return own(path, init);
            };
            """,
            text,
        )

    def let_go(self, text):
        self.js("window.gates[arguments[0]].open()", text)

    def wait_until_held(self, text):
        self.wait_for("return window.gates[arguments[0]].held > 0", text)

    def refuse(self, text):
        """From now on the service has an error for requests that hold this text."""
        self.js(
            """
            const own = window.fetch, text = arguments[0], problem = {title: "Unprocessable", detail: "light.center: is in a wall"};
            window.fetch = (path, init) => typeof init?.body === "string" && init.body.includes(text)
                ? Promise.resolve(new Response(JSON.stringify(problem), {status: 422, headers: {"Content-Type": "application/problem+json"}}))
                : own(path, init);
            """,
            text,
        )

    def test_one_refused_position_keeps_the_mask_and_the_next_goes_on(self):
        before = self.mask()["digest"]
        self.refuse("[7.25,")
        self.set_number("[name=position_x]", 7.25)
        self.wait_for("return !document.getElementById('problem').hidden")
        self.assertEqual(self.problem(), "No mask here: light.center: is in a wall")
        box = self.find("#problem")
        self.assertEqual((box.get_attribute("class"), box.get_attribute("role")), ("failure calm", "status"))
        self.assertEqual(self.mask()["digest"], before)
        self.wait_for("return getComputedStyle(document.getElementById('mask')).opacity === '0.3'")
        self.screenshot("page_refused.png")
        self.change(lambda: self.set_number("[name=position_x]", 6))
        self.assertEqual(self.problem(), "")
        self.assertNotIn("stale", self.find("#frame").get_attribute("class"))
        self.wait_for("return getComputedStyle(document.getElementById('mask')).opacity === '1'")

    def test_a_mask_stands_under_its_own_name(self):
        self.hold("ray_traced")
        self.record("busy")
        self.assertFalse(self.find("#name_a").is_displayed())
        Select(self.find("#technique_a [name=kind]")).select_by_value("ray_traced")
        self.assertEqual(self.find("#name_a").text, "soft_shadow_map: earlier")
        self.assertEqual(self.find("#frame").get_attribute("class"), "frame stale other")
        self.wait_for("return getComputedStyle(document.getElementById('mask')).opacity === '0.3'")
        self.wait_until_said("busy", "computing ray_traced, ([2-9]|\\d\\d) s")
        self.assertIn("computing ray_traced", self.said("busy"))
        self.screenshot("page_busy.png")
        self.let_go("ray_traced")
        # A draft of it at fewer pixels may come first, and says so.
        self.wait_for("return document.getElementById('name_a').hidden")
        self.assertEqual(self.find("#frame").get_attribute("class"), "frame")
        self.assertEqual(self.mask()["size"], [512, 512])
        self.wait_for("return document.getElementById('busy').hidden")
        # Another setting is another mask, too.
        self.hold('"samples":4')
        self.set_number("#technique_a [name=samples]", 4)
        self.assertEqual(self.find("#name_a").text, "ray_traced: earlier")
        self.let_go('"samples":4')
        self.wait_for("return document.getElementById('frame').className === 'frame'")

    def test_the_second_mask_stands_under_its_own_name(self):
        self.view("wipe")
        self.wait_for_b()
        self.hold("smoothie")
        Select(self.find("#technique_b [name=kind]")).select_by_value("smoothie")
        self.assertEqual(self.find("#name_b").text, "B smoothie: to come")
        self.let_go("smoothie")
        self.wait_for_b()
        self.assertEqual(self.find("#name_b").text, "B smoothie")
        self.hold("half_u")
        self.set_number("[name=position_x]", 1)
        self.assertEqual(self.find("#name_b").text, "B smoothie: earlier")
        self.assertIn("stale_b", self.find("#frame").get_attribute("class"))
        self.let_go("half_u")
        self.wait_for_b()
        self.assertEqual(self.find("#frame").get_attribute("class"), "frame")

    def overlay(self):
        """Pixels of the drawing over the mask: how many there are, where their middle is, and a digest."""
        return self.module(
            """
            await new Promise((then) => setTimeout(() => requestAnimationFrame(() => requestAnimationFrame(then)), 50));  // it is drawn every 40 ms
            const canvas = document.getElementById("overlay"), {data} = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
            let drawn = 0, x = 0, y = 0, digest = 0;
            for (let i = 0; i < data.length; i += 4) {
                if (data[i + 3] === 0) continue;
                const pixel = i / 4;
                drawn++, x += pixel % canvas.width, y += Math.floor(pixel / canvas.width), digest = (Math.imul(digest, 31) + pixel) | 0;
            }
            return {drawn, x: x / drawn / canvas.width, y: y / drawn / canvas.height, digest};
            """
        )

    def test_the_light_is_drawn_in_the_picture(self):
        self.find("#casters").click()
        # On the camera's axis, shining along it: the outline is a rectangle about the middle.
        eye, target = (4.2, 5.4, 9.4), (0.05, 0.75, -0.6)
        middle = [(e + t) / 2 for e, t in zip(eye, target)]
        for axis, value in zip("xyz", target):
            self.set_number(f"[name=target_{axis}]", value)
        self.place_light(*middle)
        drawn = self.overlay()
        self.assertGreater(drawn["drawn"], 500)
        self.assertAlmostEqual(drawn["x"], 0.5, delta=0.01)
        self.assertAlmostEqual(drawn["y"], 0.5, delta=0.01)
        # It is drawn where it is at once, before a mask comes.
        self.hold("half_u")
        self.place_light(middle[0] + 0.5, middle[1], middle[2])
        self.assertIn("stale", self.find("#frame").get_attribute("class"))
        self.assertGreater(self.overlay()["x"], drawn["x"] + 0.02)
        self.let_go("half_u")
        # Every kind; what is out of the picture or behind the camera has a mark at its edge.
        for kind in ("sphere", "point", "directional", "rectangle"):
            Select(self.find("[name=light_kind]")).select_by_value(kind)
            self.assertGreater(self.overlay()["drawn"], 20, kind)
        self.place_light(*(2 * e - t for e, t in zip(eye, target)))
        self.assertGreater(self.overlay()["drawn"], 20)
        self.find("#light_drawn").click()
        self.assertEqual(self.overlay()["drawn"], 0)
        self.settled()
        self.console_errors()  # of lights that the technique does not take

    def test_the_light_is_moved_beside_the_picture_on_a_tablet(self):
        for width, height in ((768, 1024), (1024, 768), (1024, 600)):
            self.resize(width, height)
            self.wait_for("return innerWidth === arguments[0]", width)
            boxes = self.js(
                """
                return ["light_pad", "light_height", "frame"].map((id) => document.getElementById(id).getBoundingClientRect())
                    .map(({left, top, right, bottom}) => [left, top, right, bottom]);
                """
            )
            for left, top, right, bottom in boxes:
                self.assertGreaterEqual(min(left, top), 0, (width, boxes))
                self.assertLessEqual(right, width, (width, boxes))
                self.assertLessEqual(bottom, height, (width, boxes))
            pad, _, frame = boxes
            self.assertGreaterEqual(pad[0], frame[2], "beside the picture")
            room, taken = self.js("const page = document.documentElement; return [page.clientWidth, page.scrollWidth]")
            self.assertLessEqual(taken, room, width)
            self.screenshot(f"page_tablet_{width}x{height}.png")

    def test_one_word_for_one_thing_and_code_as_code(self):
        words = self.js("return [...document.querySelectorAll('#light label')].map((one) => one.textContent.trim())")
        self.assertIn("Length", words)
        self.assertNotIn("Height", words)
        self.assertEqual(self.find("#light_height").get_attribute("aria-label"), "Height of the light")
        told = 0
        for option in [one.get_attribute("value") for one in Select(self.find("#technique_a [name=kind]")).options]:
            Select(self.find("#technique_a [name=kind]")).select_by_value(option)
            self.assertNotIn("`", self.js("return document.body.textContent"), option)
            told += len(self.browser.find_elements(By.CSS_SELECTOR, "#technique_a .help code"))
        self.assertGreater(told, 0)
        self.settled()
        self.console_errors()

    def test_two_techniques_compared(self):
        self.view("wipe")
        self.wait_for_b()
        both = self.mask()
        self.set_number("#wipe", 0)
        b = self.mask()
        self.set_number("#wipe", 100)
        a = self.mask()
        self.assertEqual(len({both["digest"], a["digest"], b["digest"]}), 3)
        self.wait_for("return document.getElementById('figures').textContent.includes('MAE')")
        figures = self.find("#figures").text
        for word in ("MAE", "RMSE", "Bias", "Max", "99 %", "soft_shadow_map against ray_traced", "B  ray_traced"):
            self.assertIn(word, figures)
        mae = float(re.search(r"MAE\s+(\S+)", figures)[1])
        self.assertTrue(0.001 < mae < 0.2, mae)
        self.assertEqual(a["coloured"], 0)
        self.view("difference")
        self.wait_for_b()
        self.assertGreater(self.mask()["coloured"], 0.01)
        self.assertTrue(self.find("#legend").is_displayed())
        self.screenshot("page_difference.png")

    def test_the_light_orbits_and_the_rate_is_shown(self):
        self.find("#orbit").click()
        time.sleep(3)
        rate = self.wait_for("return document.getElementById('rate').textContent")
        self.find("#orbit").click()
        self.assertEqual(self.find("#orbit").get_attribute("aria-pressed"), "false")
        print(f"  512 x 512, occluder map 384 x 384, beside the other tests: {rate}", flush=True)
        self.assertGreater(float(rate.split()[0]), 0)

    def test_a_dropped_depth_pass_is_lit(self):
        self.penumbra("depth", EXAMPLES / "04_relight_depth_view.json", "--out", self.folder / "view")
        self.change(lambda: self.drop(self.folder / "view" / "receiver.exr"))
        mask = self.mask()
        self.assertEqual(mask["size"], [256, 256])
        self.assert_shadowed(mask)
        self.assertEqual(self.problem(), "")
        self.assertIn("-F receiver.exr=@receiver.exr", self.find("#curl_line").text)
        # The eye is 9 from the target; the median of what it sees is near that.
        scene = self.scene_file()
        self.assertTrue(7 < -scene["receivers"]["camera"]["target"][2] < 11, scene["receivers"])
        self.assertEqual(scene["objects"][0]["depth"], "receiver.exr")
        self.change(lambda: self.find("#light_pad").send_keys(Keys.ARROW_RIGHT))
        self.assertNotEqual(mask["digest"], self.mask()["digest"])
        # The scene file that the page shows is one that the command line takes.
        (self.folder / "view" / "page.json").write_text(json.dumps(scene))
        self.penumbra("mask", self.folder / "view" / "page.json", "-o", self.folder / "page.pfm")

    def scene_file(self):
        self.js("document.querySelector('#share details').open = true")
        return json.loads(self.wait_for("return document.getElementById('scene_text').textContent"))

    def test_maps_seen_from_a_light_change_its_size_only(self):
        self.penumbra("depth", EXAMPLES / "square.json", "--out", self.folder / "square")
        names = sorted(path.name for path in (self.folder / "square").glob("*.exr"))
        front = next(name for name in names if "front" in name)
        receiver = next(name for name in names if "recei" in name)
        self.change(lambda: self.drop(self.folder / "square" / front, self.folder / "square" / receiver))
        self.assertEqual(self.problem(), "")
        self.assertIn("Only the size can change", self.find("#fixed_light").text)
        self.assertEqual(self.browser.find_elements(By.CSS_SELECTOR, "#light_pad"), [])
        self.assertFalse(self.find("#orbit").is_enabled())
        before = self.mask()
        self.assert_shadowed(before)
        self.change(lambda: self.set_number("[name=light_length]", 2.5))
        self.assertNotEqual(before["digest"], self.mask()["digest"])

    def test_picked_files_do_as_dropped_ones(self):
        self.penumbra("depth", EXAMPLES / "04_relight_depth_view.json", "--out", self.folder / "picked")
        Select(self.find("[name=source]")).select_by_value("camera")
        self.find("#file_depth").send_keys(str(self.folder / "picked" / "receiver.exr"))
        distance = self.find("[name=distance]")
        distance.clear()
        distance.send_keys("9")
        self.change(lambda: self.find("#source .primary").click())
        self.assertEqual(self.mask()["size"], [256, 256])
        self.assertEqual(self.scene_file()["receivers"]["camera"]["target"], [0, 0, -9])

    def test_a_bad_file_shows_what_the_service_says(self):
        bad = self.folder / "broken.exr"
        bad.write_bytes(b"\x76\x2f\x31\x01 no image follows")
        # A mask that is on its way meanwhile has nothing to say of the file.
        self.hold("soft_shadow_map")
        self.set_number("[name=position_x]", 2)
        self.wait_until_held("soft_shadow_map")
        self.drop(bad)
        self.wait_for("return !document.getElementById('problem').hidden")
        self.assertIn("broken.exr", self.problem())
        self.let_go("soft_shadow_map")
        self.wait_for("const d = document.getElementById('mask').dataset; return d.technique === 'soft_shadow_map' && d.version === d.asked")
        self.assertIn("broken.exr", self.problem())
        self.assertTrue(all("422" in error or "400" in error for error in self.console_errors()))
        # The page goes on.
        self.change(lambda: Select(self.find("[name=source]")).select_by_value("courtyard"))
        self.assertEqual(self.problem(), "")

    def test_downloads_have_the_formats_that_they_say(self):
        heads = self.module(
            """
            const [{Client}, scenes, {FORMATS}] = await Promise.all(["client", "scene", "share_panel"].map(page));
            const source = scenes.courtyard_source(), client = new Client(), heads = {};
            for (const format of FORMATS) {
                const {buffer} = await client.mask(scenes.scene_json(source, source.light, {kind: "shadow_map", settings: {}}), source.files, format.media_type);
                heads[format.extension] = [...new Uint8Array(buffer).slice(0, 26)];
            }
            return heads;
            """
        )
        self.assertEqual(bytes(heads["png"][:8]), b"\x89PNG\r\n\x1a\n")
        self.assertEqual(heads["png"][24], 16)  # bits a sample
        self.assertEqual(bytes(heads["exr"][:4]), b"\x76\x2f\x31\x01")
        self.assertIn(bytes(heads["tif"][:4]), (b"II*\0", b"MM\0*"))
        self.assertEqual(bytes(heads["pfm"][:2]), b"Pf")

    def test_the_mask_is_saved(self):
        self.browser.execute_cdp_cmd("Browser.setDownloadBehavior", {"behavior": "allow", "downloadPath": str(self.folder)})
        self.find("#share .buttons button").click()
        self.wait_for("return document.getElementById('said').textContent === 'mask.png saved'")
        saved = self.folder / "mask.png"
        end = time.monotonic() + WAIT_S
        while not saved.exists() and time.monotonic() < end:
            time.sleep(0.03)
        self.assertEqual(saved.read_bytes()[:8], b"\x89PNG\r\n\x1a\n")

    def test_a_kept_scene_that_is_gone_is_sent_again(self):
        kept = self.module(
            """
            const [{Client}, scenes] = await Promise.all(["client", "scene"].map(page));
            const source = scenes.courtyard_source(), client = new Client();
            const scene = scenes.scene_json(source, source.light, {kind: "shadow_map", settings: {}});
            const ask = async () => new Uint8Array((await client.mask(scene, source.files, "image/x-portable-floatmap")).buffer);
            const first = await ask();
            const sent = performance.getEntriesByType("resource").map((entry) => entry.name).filter((name) => name.includes("/v1/scenes/"));
            const removed = (await fetch(new URL(sent.at(-1)).pathname.replace(/\\/masks$/, ""), {method: "DELETE"})).status;
            const second = await ask();
            return {keeps: client.keeps, removed, same: first.every((byte, i) => byte === second[i])};
            """
        )
        self.assertEqual(kept, {"keeps": True, "removed": 204, "same": True})
        self.assertTrue(all("404" in error for error in self.console_errors()))

    def test_nothing_is_asked_of_another_host(self):
        self.view("wipe")
        self.wait_for_b()
        asked = self.requests()
        self.assertGreater(len(asked), 10)
        for address in asked:
            self.assertTrue(address.startswith((self.server.url + "/", "blob:" + self.server.url, "data:", "about:", "chrome:")), address)

    def test_every_control_has_a_name_and_takes_the_focus(self):
        self.view("wipe")
        self.js("document.querySelectorAll('details').forEach((one) => (one.open = true))")
        nodes = self.browser.execute_cdp_cmd("Accessibility.getFullAXTree", {})["nodes"]
        controls = [node for node in nodes if node.get("role", {}).get("value") in
                    ("button", "slider", "spinbutton", "combobox", "checkbox", "radio", "textbox", "application") and not node.get("ignored")]
        self.assertGreater(len(controls), 25)
        for node in controls:
            self.assertTrue(node.get("name", {}).get("value"), node)
        unreachable = self.js("return [...document.querySelectorAll('input, select, button, canvas.pad')].filter((one) => one.tabIndex < 0).length")
        self.assertEqual(unreachable, 0)

    def test_it_fits_narrow_and_wide(self):
        for width, dark in ((360, False), (360, True), (1440, False)):
            self.resize(width, 800, dark)
            for mode in ("mask", "wipe"):
                self.view(mode)
                room, taken = self.js("const page = document.documentElement; return [page.clientWidth, page.scrollWidth]")
                self.assertLessEqual(taken, room, (width, mode))
            if width == 360:
                self.screenshot("page_narrow_dark.png" if dark else "page_narrow.png")


class Relit(PageTest):
    """One camera's depth: drafts while the light moves, and its picture under the light."""

    def setUp(self):
        super().setUp()
        view = self.folder / "view"
        if not view.exists():
            self.penumbra("depth", EXAMPLES / "04_relight_depth_view.json", "--out", view)
        self.depth = view / "receiver.exr"

    find, set_number, scene_file = Page.find, Page.set_number, Page.scene_file
    delay, hold, let_go, wait_until_held = Page.delay, Page.hold, Page.let_go, Page.wait_until_held

    def picture(self, name, width=256, height=256):
        path = self.folder / name
        path.write_bytes(png_bytes(width, height, lambda x, y: (x * 255 // width, y * 255 // height, 128)))
        return path

    def wait_for_trace(self):
        self.wait_for("const d = document.getElementById('mask').dataset; return d.technique === 'depth_trace' && d.version")

    def wait_for_rest(self):
        """Until the light rests, with its trace, and for longer than it has to rest: nothing comes after."""
        self.wait_for("const d = document.getElementById('mask').dataset; return d.technique === 'depth_trace' && d.version === d.asked")
        time.sleep(0.5)

    def drop_and_trace(self, *paths):
        self.change(lambda: self.drop(*paths))
        self.wait_for_trace()

    def watch(self):
        """From now on, each technique, version, name and width that is shown."""
        self.js(
            """
            const mask = document.getElementById("mask");
            window.seen = [];
            window.watcher?.disconnect();
            window.watcher = new MutationObserver(() => {
                const one = [mask.dataset.technique, Number(mask.dataset.version), document.getElementById("name_a").textContent, mask.width];
                if (String(window.seen.at(-1)) !== String(one)) window.seen.push(one);
            });
            window.watcher.observe(mask, {attributes: true, attributeFilter: ["data-version", "data-technique"]});
            """
        )

    def drag_light(self):
        pad = self.find("#light_pad")
        ActionChains(self.browser, duration=60).move_to_element_with_offset(pad, -40, 20).click_and_hold().move_by_offset(30, -20).move_by_offset(
            40, 30).move_by_offset(-20, 20).release().perform()

    def test_a_draft_while_the_light_moves_and_the_trace_when_it_rests(self):
        self.delay("depth_trace", 0.8)
        self.drop_and_trace(self.depth)
        self.assertEqual(Select(self.find("#technique_a [name=kind]")).first_selected_option.get_attribute("value"), "depth_trace")
        self.assertTrue(self.find("#draft").is_selected() and self.find("#draft").is_displayed())
        self.assertEqual(self.find("#name_a").text, "depth_trace")
        self.assertEqual(self.scene_file()["technique"], {"kind": "depth_trace"})
        rested = self.mask()
        self.watch()
        self.drag_light()
        self.wait_for_rest()
        seen = self.js("return window.seen")
        self.assertEqual(seen[0][0], "soft_shadow_map", seen)
        self.assertEqual(seen[-1][0], "depth_trace", seen)
        versions = [version for _, version, *_ in seen]
        self.assertEqual(versions, sorted(versions), "no earlier mask takes the place of a later one")
        self.assertEqual(versions[-1], max(versions))
        self.assertNotEqual(rested["digest"], self.mask()["digest"])
        # The drafts were called so.
        self.change(lambda: self.find("#light_pad").send_keys(Keys.ARROW_RIGHT))
        self.assertIn("depth_trace", self.find("#name_a").text)
        self.wait_for("return document.getElementById('name_a').textContent === 'depth_trace'")
        self.assertEqual(self.problem(), "")

    def test_the_label_says_that_it_is_a_draft(self):
        self.delay("depth_trace", 0.8)
        self.drop_and_trace(self.depth)
        self.hold("depth_trace")
        self.change(lambda: self.find("#light_pad").send_keys(Keys.ARROW_RIGHT))
        self.assertEqual(self.find("#name_a").text, "soft_shadow_map: draft; depth_trace when the light rests")
        # A light that moves on is not kept waiting by the trace of where it was.
        self.wait_until_held("depth_trace")
        self.change(lambda: self.find("#light_pad").send_keys(Keys.ARROW_DOWN))
        self.let_go("depth_trace")
        self.wait_for_trace()

    def test_no_draft_where_the_trace_is_as_quick(self):
        self.delay("soft_shadow_map", 3)
        self.drop_and_trace(self.depth)
        self.watch()
        self.drag_light()
        self.wait_for_rest()
        self.assertEqual({technique for technique, *_ in self.js("return window.seen")}, {"depth_trace"})
        self.assertEqual(self.find("#name_a").text, "depth_trace")

    def test_drafts_can_be_switched_off(self):
        self.delay("depth_trace", 0.8)
        self.drop_and_trace(self.depth)
        self.change(lambda: self.find("#draft").click())
        self.watch()
        self.drag_light()
        self.wait_for_rest()
        self.assertEqual({technique for technique, *_ in self.js("return window.seen")}, {"depth_trace"})
        # What is no trace has no draft, and neither has the courtyard.
        self.change(lambda: Select(self.find("#technique_a [name=kind]")).select_by_value("soft_shadow_map"))
        self.assertFalse(self.find("#draft").is_displayed())
        self.change(lambda: Select(self.find("[name=source]")).select_by_value("courtyard"))
        self.assertEqual(Select(self.find("#technique_a [name=kind]")).first_selected_option.get_attribute("value"), "soft_shadow_map")
        self.assertFalse(self.find("#name_a").is_displayed())

    def test_a_sphere_has_a_draft_that_takes_it(self):
        self.delay("depth_trace", 0.8)
        self.drop_and_trace(self.depth)
        self.watch()
        self.change(lambda: Select(self.find("[name=light_kind]")).select_by_value("sphere"))
        self.wait_for("return window.seen.length > 0 && window.seen.at(-1)[0] === 'depth_trace'")
        self.assertEqual(self.js("return window.seen")[0][0], "soft_shadow_map")
        self.assertEqual(self.problem(), "")

    def test_the_picture_under_the_light_as_the_command_line_makes_it(self):
        photo = self.picture("photo.png")
        self.drop_and_trace(photo, self.depth)
        self.assertTrue(self.find("#shows [value=picture]").is_selected())
        self.assertGreater(self.mask()["coloured"], 0.5)
        self.assertIn("photo.png under this light alone", self.find("#picture_note").text)
        self.assertIn("photo.png, a PNG of 8-bit colours: taken as the picture", self.find("#picture_said").text)
        self.assertIn("--over 'photo.png' --preview preview.png", self.find("#penumbra_line").text)
        scene = self.folder / "view" / "page.json"
        scene.write_text(json.dumps(self.scene_file()))
        preview = self.folder / "preview.png"
        self.penumbra("mask", scene, "-o", self.folder / "mask.pfm", "--over", photo, "--preview", preview)
        worst = self.module(
            """
            const bytes = Uint8Array.from(atob(given[0]), (c) => c.charCodeAt(0));
            const bitmap = await createImageBitmap(new Blob([bytes]));
            const context = new OffscreenCanvas(bitmap.width, bitmap.height).getContext("2d");
            context.drawImage(bitmap, 0, 0);
            const expected = context.getImageData(0, 0, bitmap.width, bitmap.height).data;
            const canvas = document.getElementById("mask");
            const shown = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data;
            return expected.length === shown.length ? shown.reduce((most, value, i) => Math.max(most, Math.abs(value - expected[i])), 0) : -1;
            """,
            base64.b64encode(preview.read_bytes()).decode(),
        )
        self.assertIn(worst, (0, 1))  # both round
        # It follows the light, and gives way to the mask.
        before = self.mask()["digest"]
        self.change(lambda: self.find("#light_pad").send_keys(Keys.SHIFT + Keys.ARROW_RIGHT))
        self.wait_for_trace()
        self.assertNotEqual(before, self.mask()["digest"])
        self.js("document.querySelector('[name=shows][value=mask]').click()")
        self.assertEqual(self.mask()["coloured"], 0)
        self.assertFalse(self.find("#picture_note").is_displayed())

    def test_a_picture_of_another_size_is_scaled_and_one_of_another_shape_refused(self):
        self.drop_and_trace(self.depth, self.picture("large.png", 512, 510))
        self.assertIn("It is 512 x 510, drawn at the mask's 256 x 256", self.find("#picture_note").text)
        self.assertGreater(self.mask()["coloured"], 0.5)
        self.assertNotIn("--over", self.find("#penumbra_line").text)
        self.drop(self.picture("wide.png", 300, 200))
        note = self.wait_for("const note = document.getElementById('picture_note'); return note.textContent.includes('wide.png') && note.textContent")
        for part in ("300 x 200", "256 x 256", "1 %"):
            self.assertIn(part, note)
        self.assertFalse(self.find("#shows [value=picture]").is_enabled())
        self.assertEqual(self.mask()["coloured"], 0)

    def test_a_picture_by_itself_waits_for_its_depth(self):
        jpeg = self.folder / "photo.jpg"
        jpeg.write_bytes(base64.b64decode(self.module(
            """
            const canvas = Object.assign(document.createElement("canvas"), {width: 256, height: 256});
            canvas.getContext("2d").fillStyle = "rgb(200 100 50)";
            canvas.getContext("2d").fillRect(0, 0, 256, 256);
            return canvas.toDataURL("image/jpeg").split(",")[1];
            """)))
        self.drop(jpeg)
        self.wait_for("return !document.getElementById('problem').hidden")
        self.assertIn("photo.jpg is taken as a picture, a JPEG. Its depth image is missing", self.problem())
        self.drop_and_trace(self.depth)
        self.assertEqual(self.problem(), "")
        self.assertGreater(self.mask()["coloured"], 0.5)
        # Another picture over the same depth leaves the light where it is.
        self.change(lambda: self.find("#light_pad").send_keys(Keys.ARROW_RIGHT))
        self.wait_for_trace()
        light = self.scene_file()["light"]
        self.drop(self.picture("other.png"))
        self.wait_for("return document.getElementById('picture_note').textContent.includes('other.png')")
        self.assertEqual(self.scene_file()["light"], light)
        # What was taken wrongly is swapped by hand: the service says what it thinks of this.
        next(one for one in self.browser.find_elements(By.CSS_SELECTOR, "#source button") if one.text == "Swap picture and depth").click()
        self.wait_for("return !document.getElementById('problem').hidden")
        self.assertIn("other.png", self.problem() + self.find("#source").text)
        self.console_errors()

    def test_a_large_image_has_a_draft_at_fewer_pixels(self):
        scene = json.loads((EXAMPLES / "04_relight_depth_view.json").read_text())
        scene["receivers"]["resolution"] = [1280, 720]
        (self.folder / "large.json").write_text(json.dumps(scene))
        self.penumbra("depth", self.folder / "large.json", "--out", self.folder / "large")
        self.hold("depth_trace")
        self.requests()
        self.change(lambda: self.drop(self.folder / "large" / "receiver.exr"))
        self.assertEqual(self.mask()["size"], [512, 288])
        self.assertEqual(self.find("#name_a").text, "soft_shadow_map: draft at 512 x 288; depth_trace when the light rests")
        self.assertIn("soft_shadow_map at 512 x 288 while the light moves", self.find("#draft_help").text)
        # One request asked for the depth.
        self.assertEqual(len([one for one in self.requests() if "/v1/depth" in one]), 1)
        self.let_go("depth_trace")
        self.wait_for_trace()
        self.assertEqual(self.mask()["size"], [1280, 720])
        self.assertEqual(self.scene_file()["receivers"]["depth"], "receiver.exr")
        # A technique that is no trace, and does not keep pace, has itself as a draft.
        self.delay("soft_shadow_map", 0.2)
        self.change(lambda: Select(self.find("#technique_a [name=kind]")).select_by_value("soft_shadow_map"))
        self.wait_for("return document.getElementById('mask').width === 1280")
        self.watch()
        self.change(lambda: self.find("#light_pad").send_keys(Keys.ARROW_RIGHT))
        self.wait_for("const mask = document.getElementById('mask'); return mask.width === 1280 && mask.dataset.version === mask.dataset.asked")
        self.assertEqual([self.js("return window.seen")[0][3], self.mask()["size"]], [512, [1280, 720]])

    def choose_channel(self, path, label):
        """Drops an image that has several, and chooses one of those that the page lists."""
        self.drop(path)
        self.wait_for("return document.querySelector('[name=channel]')")
        listed = Select(self.find("[name=channel]"))
        texts = [one.text for one in listed.options]
        self.assertIn("Choose it under Scene, Channel.", self.problem())
        self.assertEqual(self.js("return document.activeElement.name"), "channel")
        self.change(lambda: listed.select_by_visible_text(label))
        self.assertEqual(self.problem(), "")
        self.assertEqual(Select(self.find("[name=channel]")).first_selected_option.text, label)
        return texts

    def test_a_channel_is_chosen_where_there_are_several(self):
        path = self.folder / "two.exr"
        path.write_bytes(exr_bytes(16, 12, [("", {"near.Depth.Z": 2, "far.Depth.Z": 8, "A": 1})]))
        self.assertEqual(self.choose_channel(path, "far.Depth.Z"), ["choose ...", "A", "far.Depth.Z", "near.Depth.Z"])
        scene = self.scene_file()
        self.assertEqual(scene["receivers"]["encoding"], {"kind": "planar", "channel": "far.Depth.Z"})
        self.assertEqual(scene["receivers"]["camera"]["target"], [0, 0, -8])
        self.change(lambda: Select(self.find("[name=channel]")).select_by_visible_text("near.Depth.Z"))
        self.assertEqual(self.scene_file()["receivers"]["camera"]["target"], [0, 0, -2])
        self.screenshot("page_channels.png")
        # They are not the next image's.
        self.change(lambda: self.drop(self.depth))
        self.assertEqual(self.browser.find_elements(By.CSS_SELECTOR, "[name=channel]"), [])
        self.assertNotIn("encoding", self.scene_file()["receivers"])
        self.assertTrue(all("422" in error for error in self.console_errors()))

    def test_a_part_is_chosen_where_there_are_several(self):
        path = self.folder / "parts.exr"
        path.write_bytes(exr_bytes(16, 12, [("left", {"Depth.Z": 3}), ("right", {"Depth.Z": 5})]))
        self.assertEqual(self.choose_channel(path, "Depth.Z (part 1)"), ["choose ...", "Depth.Z (part 0)", "Depth.Z (part 1)"])
        scene = self.scene_file()
        self.assertEqual(scene["receivers"]["encoding"], {"kind": "planar", "channel": "Depth.Z", "part": 1})
        self.assertEqual(scene["receivers"]["camera"]["target"], [0, 0, -5])
        self.assertTrue(all("422" in error for error in self.console_errors()))

    def test_a_channel_without_a_telling_name_is_chosen(self):
        path = self.folder / "unnamed.exr"
        path.write_bytes(exr_bytes(16, 12, [("", {"first": 3, "second": 4})]))
        self.assertEqual(self.choose_channel(path, "second"), ["choose ...", "first", "second"])
        self.assertEqual(self.scene_file()["receivers"]["camera"]["target"], [0, 0, -4])
        self.assertTrue(all("422" in error for error in self.console_errors()))

    def test_bounds_are_saved(self):
        self.drop_and_trace(self.depth)
        self.browser.execute_cdp_cmd("Browser.setDownloadBehavior", {"behavior": "allow", "downloadPath": str(self.folder)})
        next(one for one in self.browser.find_elements(By.CSS_SELECTOR, "#share .buttons button") if one.text == "Bounds, EXR").click()
        self.wait_for("return document.getElementById('said').textContent === 'bound.exr saved'")
        end = time.monotonic() + WAIT_S
        while not (self.folder / "bound.exr").exists() and time.monotonic() < end:
            time.sleep(0.03)
        self.assertEqual((self.folder / "bound.exr").read_bytes()[:4], b"\x76\x2f\x31\x01")
        self.change(lambda: Select(self.find("#technique_a [name=kind]")).select_by_value("soft_shadow_map"))
        self.assertNotIn("Bounds, EXR", [one.text for one in self.browser.find_elements(By.CSS_SELECTOR, "#share .buttons button") if one.is_displayed()])


class Away(PageTest):
    """The service ends, and comes back."""

    find, set_number = Page.find, Page.set_number

    def outage(self):
        return self.js("const one = document.getElementById('outage'); return one.hidden ? '' : one.textContent")

    def setUp(self):
        self.own = Server(PENUMBRA_SERVER_QUEUE="8")
        self.addCleanup(lambda: self.own.stop())
        self.open(self.own)

    def test_it_waits_for_a_service_that_does_not_answer_and_goes_on(self):
        before = self.mask()["digest"]
        port = int(self.own.url.rsplit(":", 1)[1])
        self.own.stop()
        self.record("outage")
        self.set_number("[name=position_x]", 2)
        self.wait_until_said("outage", "The service does not answer; trying again in 4 s")
        said = [text.split(";")[1].strip() for text in self.said("outage")]
        self.assertEqual(said[:6], ["trying again " + when for when in ("in 1 s", "now", "in 2 s", "in 1 s", "now", "in 4 s")])
        self.assertEqual(self.problem(), "")
        self.assertEqual(self.mask()["digest"], before)
        self.assertIn("stale", self.find("#frame").get_attribute("class"))
        self.screenshot("page_away.png")
        # What is changed meanwhile is what is asked for then.
        self.set_number("[name=position_x]", -2)
        self.own = Server(port=port)
        self.settled()
        self.assertEqual(self.outage(), "")
        self.assertNotEqual(self.mask()["digest"], before)
        self.assertEqual(self.problem(), "")
        self.assertEqual(self.find("#frame").get_attribute("class"), "frame")
        self.assertTrue(all("ERR_" in error or "404" in error or "503" in error for error in self.console_errors()))

    def test_a_busy_service_says_when(self):
        self.js(
            """
            const own = window.fetch;
            window.asked = [];
            window.fetch = (path, init) => {
                if (!path.includes("/masks")) return own(path, init);
                window.asked.push(performance.now());
                return window.asked.length > 1 ? own(path, init) : Promise.resolve(new Response(JSON.stringify({detail: "every place is taken"}),
                    {status: 503, headers: {"Retry-After": "3"}}));
            };
            """
        )
        self.record("outage")
        self.set_number("[name=position_x]", 2)
        self.wait_until_said("outage", "The service has no time: every place is taken; trying again in 3 s")
        self.settled()
        said = ["The service has no time: every place is taken; trying again " + when for when in ("in 3 s", "in 2 s", "in 1 s", "now")]
        self.assertEqual(self.said("outage"), [*said, ""])
        self.assertEqual(self.outage(), "")
        first, second = self.js("return window.asked")[:2]  # the third may be on its way by now
        self.assertGreater(second - first, 2999)


class Token(PageTest):
    def setUp(self):
        pass

    def test_a_token_is_asked_for_and_used(self):
        secret = "a-token-of-the-test-only"
        server = Server(PENUMBRA_SERVER_TOKEN=secret)
        self.addCleanup(server.stop)
        self.browser.get(server.url + "/")
        self.wait_for("return !document.getElementById('token_form').hidden")
        self.assertTrue(all("401" in error for error in self.console_errors()))
        field = self.browser.find_element(By.ID, "token")
        field.send_keys(secret + Keys.ENTER)
        self.wait_for("return document.getElementById('mask').dataset.version")
        self.assertEqual(self.problem(), "")
        self.assertEqual(self.js("return JSON.stringify([{...localStorage}, {...sessionStorage}, document.cookie])"), '[{},{},""]')
        self.assertNotIn(secret, self.js("return document.body.textContent"))


if __name__ == "__main__":
    unittest.main(verbosity=2)
