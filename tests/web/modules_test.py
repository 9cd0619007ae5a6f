"""The page's modules on their own: float maps, error figures, the queue, controls from a schema, the light."""

import base64
import json
import math
import struct
import unittest

from browser import PageTest


class Modules(PageTest):
    def test_float_maps_have_rows_from_the_top_in_both_byte_orders(self):
        for scale, little in (("-1.0", True), ("1.0", False)):
            got = self.module(
                """
                const {decode_pfm} = await page("pfm");
                const head = new TextEncoder().encode(`Pf\\n2 3\\n${given[0]}\\n`);
                const buffer = new ArrayBuffer(head.length + 24);
                new Uint8Array(buffer).set(head);
                const view = new DataView(buffer);
                [5, 6, 3, 4, 1, 2].forEach((value, i) => view.setFloat32(head.length + 4 * i, value, given[1]));
                const image = decode_pfm(buffer);
                return [image.width, image.height, image.channels, ...image.pixels];
                """,
                scale,
                little,
            )
            self.assertEqual(got, [2, 3, 1, 1, 2, 3, 4, 5, 6])

    def test_broken_float_maps_are_errors(self):
        for text in ("", "Pf", "Pf\n2 2\n-1.0", "P5\n2 2\n-1.0\n", "Pf\n2 2\n0\n" + 16 * "x", "Pf\n0 2\n-1\n", "Pf\n2 2\n-1.0\n" + 15 * "x",
                     "PF\n2 2\n-1.0\n" + 16 * "x", "Pf\n2.5 2\n-1.0\n" + 20 * "x"):
            message = self.module(
                """
                const {decode_pfm} = await page("pfm");
                try { decode_pfm(new TextEncoder().encode(given[0]).buffer); } catch (error) { return error.message; }
                return "";
                """,
                text,
            )
            self.assertIn("float map", message, text)

    def test_figures_by_hand(self):
        # Four pixels, of which the last is lit in both: differences -0.2, 0.1, 0 over three.
        got = self.module(
            """
            const {compare} = await page("metrics");
            const image = (values) => ({width: 4, height: 1, channels: 1, pixels: Float32Array.from(values)});
            return compare(image([0.25, 0.625, 0, 1]), image([0.5, 0.5, 0, 0.9995]));
            """
        )
        self.assertEqual((got["pixels"], got["pixels_shadow"]), (4, 3))
        self.assertAlmostEqual(got["mae_shadow"], 0.125, 12)
        self.assertAlmostEqual(got["bias_shadow"], -0.125 / 3, 12)
        self.assertAlmostEqual(got["rmse_shadow"], math.sqrt((0.0625 + 0.015625) / 3), 12)
        self.assertAlmostEqual(got["p99_shadow"], 0.125 + 0.98 * 0.125, 12)
        self.assertEqual(got["max"], 0.25)

    def test_masks_of_two_sizes_are_not_compared(self):
        message = self.module(
            """
            const {compare} = await page("metrics");
            const image = (width) => ({width, height: 1, channels: 1, pixels: new Float32Array(width)});
            try { compare(image(2), image(3)); } catch (error) { return error.message; }
            """
        )
        self.assertIn("width: 2 and 3", message)

    def test_figures_are_those_of_penumbra_compare(self):
        got = self.module(
            """
            const [{Client}, {decode_pfm}, {compare}, scenes] = await Promise.all(["client", "pfm", "metrics", "scene"].map(page));
            const source = {...scenes.courtyard_source()};
            source.receivers = {...source.receivers, resolution: [128, 128]};
            const client = new Client();
            const buffers = [];
            for (const technique of [{kind: "soft_shadow_map", settings: {}}, {kind: "ray_traced", settings: {samples: 16}}])
                buffers.push((await client.mask_once(scenes.scene_json(source, source.light, technique), source.files, "image/x-portable-floatmap")).buffer);
            const text = (buffer) => btoa([...new Uint8Array(buffer)].map((byte) => String.fromCharCode(byte)).join(""));
            return {figures: compare(...buffers.map(decode_pfm)), files: buffers.map(text)};
            """
        )
        paths = [self.folder / "test.pfm", self.folder / "reference.pfm"]
        for path, text in zip(paths, got["files"]):
            path.write_bytes(base64.b64decode(text))
        expected = json.loads(self.penumbra("compare", *paths, "--json"))
        self.assertGreater(expected["pixels_shadow"], 500)
        self.assertGreater(expected["mae_shadow"], 0.001)
        for key, value in got["figures"].items():
            # Sums of at most 3 * 128 * 128 numbers up to 1 in binary64, one compensated and one plain: n u relative at most, u = 2^-53.
            self.assertAlmostEqual(value, expected[key], delta=3 * 128 * 128 * 2.0**-53, msg=key)

    def test_queue_runs_one_at_a_time_and_keeps_the_last(self):
        got = self.module(
            """
            const {LatestQueue} = await page("queue");
            const queue = new LatestQueue(), ran = [];
            let running = 0, most = 0;
            const job = (name) => async () => {
                most = Math.max(most, ++running);
                await new Promise((then) => setTimeout(then, 20));
                ran.push(name);
                running--;
            };
            for (const name of ["a", "b", "c", "d"]) queue.push(job(name));
            await new Promise((then) => setTimeout(then, 120));
            queue.push(job("e"));
            await new Promise((then) => setTimeout(then, 60));
            return {ran, most, busy: queue.busy};
            """
        )
        self.assertEqual(got, {"ran": ["a", "d", "e"], "most": 1, "busy": False})

    def test_a_service_that_is_away_is_asked_less_and_less(self):
        got = self.module(
            """
            const [{Outage}, {NoAnswer, ServiceError}] = await Promise.all(["outage", "client"].map(page));
            const said = [], slept = [];
            const outage = new Outage((text) => said.push(text), async (ms) => { slept.push(ms); });
            const waits = async (error) => {
                const from = slept.length;
                await outage.wait(error);
                return slept.slice(from).reduce((sum, ms) => sum + ms, 0) / 1000;
            };
            const busy = (retry_after_s) => new ServiceError(503, "full", "busy", retry_after_s);
            const result = {away: []};
            for (let i = 0; i < 6; i++) result.away.push(await waits(new NoAnswer()));
            outage.over();
            result.last = said.at(-1);
            outage.over();
            result.quiet = said.at(-2) !== "";
            result.again = await waits(new NoAnswer());
            result.told = await waits(busy(7));
            result.short = await waits(busy(0.5));
            result.untold = await waits(busy(0));
            const from = slept.length;
            await Promise.all([outage.wait(new NoAnswer()), outage.wait(new NoAnswer())]);
            result.together = slept.length - from;
            result.first = said.slice(0, 4);
            result.is = [new NoAnswer(), busy(1), new ServiceError(422, "", "", 0), new Error()].map(Outage.is);
            return result;
            """
        )
        self.assertEqual(got["away"], [1, 2, 4, 8, 15, 15])
        self.assertEqual((got["last"], got["quiet"]), ("", True))
        self.assertEqual((got["again"], got["told"], got["short"], got["untold"]), (1, 7, 0.5, 8))
        self.assertEqual(got["together"], 15, "one wait for both, a second at a time")
        text = "The service does not answer; trying again "
        self.assertEqual(got["first"], [text + "in 1 s", text + "now", text + "in 2 s", text + "in 1 s"])
        self.assertEqual(got["is"], [True, True, False, False])

    def test_the_median_is_that_of_what_is_seen(self):
        got = self.module(
            """
            const {median_of} = await page("depth_view");
            return [[3, 1, Infinity, 2], [10, 9, 100], [Infinity, NaN], []].map((values) => median_of(Float32Array.from(values)));
            """
        )
        self.assertEqual(got, [2, 10, None, None])

    def test_depth_is_read_as_the_service_reads_it(self):
        pixels = struct.pack("<4f", 4, 2, 1, 0)  # from the last row up: disparities, of which 0 is nothing
        got = self.module(
            """
            const [{Client}, {depth_view}] = await Promise.all(["client", "depth_view"].map(page));
            const bytes = Uint8Array.from(atob(given[0]), (c) => c.charCodeAt(0));
            const view = await depth_view(new Client(), "d.pfm", new Blob([bytes]), {kind: "disparity", scale: 8}, 50);
            return {...view, file: view.file.size};
            """,
            base64.b64encode(b"Pf\n2 2\n-1\n" + pixels).decode(),
        )
        self.assertEqual((got["width"], got["height"], got["size"], got["median"]), (2, 2, [2, 2], 4))

    def test_channels_are_those_that_the_service_lists(self):
        got = self.module("const {channels_in} = await page('channels'); return given.map(channels_in);",
                          "receivers.depth: a.exr has no channel that is depth for certain; it has R, G, B (name one with encoding.channel)",
                          'a.exr has more than one depth: Z in part 0 "x", Z in part 2; it has part 0 "x": Z; part 2: A, Z (choose one with encoding.part or encoding.channel)',
                          'a.exr has no channel "q"; it has a.Z, b.Z and 12 more', "light.radius: is below 0; it has no place", "")
        self.assertEqual(got[0], [{"channel": one} for one in "RGB"])
        self.assertEqual(got[1], [{"channel": "Z", "part": 0}, {"channel": "A", "part": 2}, {"channel": "Z", "part": 2}])
        self.assertEqual(got[2], [{"channel": "a.Z"}, {"channel": "b.Z"}])
        self.assertEqual(got[3:], [[], []])

    def test_a_light_is_crowded_where_a_caster_is_nearer_than_its_corners(self):
        got = self.module(
            """
            const {distance_to, is_crowded, eased} = await page("crowding");
            const quad = {center: [0, 0, 0], half_u: [2, 0, 0], half_v: [0, 0, -1]};
            const light = (x, y, z) => ({kind: "rectangle", position: [x, y, z], target: [0, 0, 0], width: 0.6, length: 0.8, radius: 0, angular_diameter_deg: 0});
            const near = light(0, 0.4, 0), objects = [{quad}], of = (kind, resolution) => eased({kind, settings: {resolution}}, near, objects).settings.resolution;
            return {
                distances: [[0, 3, 0], [2, 0, 1], [5, 4, 0], [1, 0, -3]].map((point) => distance_to(point, quad)),
                crowded: [is_crowded(near, objects), is_crowded(light(0, 0.6, 0), objects), is_crowded(near, [{quad, casts: false}]), is_crowded({...near, kind: "point"}, objects)],
                map: [of("soft_shadow_map", 0), of("soft_shadow_map", 512), of("soft_shadow_map", 32), of("smoothie", 512)],
            };
            """
        )
        self.assertEqual(got["distances"], [3, 0, 5, 2])
        self.assertEqual(got["crowded"], [True, False, False, False])  # the corners are 0.5 from the middle
        self.assertEqual(got["map"], [48, 48, 32, 512])

    def test_a_line_is_cut_where_the_camera_stands(self):
        got = self.module(
            """
            const {before_camera} = await page("light_outline");
            const square = [[-1, 0, -1], [1, 0, -1], [1, 0, 3], [-1, 0, 3]];
            return [before_camera(square, 1, true), before_camera(square.slice(1, 3), 1, false), before_camera([[0, 0, -1], [0, 0, -2]], 1, true)];
            """
        )
        self.assertEqual(sorted(map(tuple, got[0])), [(-1, 0, 1), (-1, 0, 3), (1, 0, 1), (1, 0, 3)])
        self.assertEqual(got[1], [[1, 0, 1], [1, 0, 3]])
        self.assertEqual(got[2], [])

    def test_a_technique_that_nobody_knows_yet_gets_controls(self):
        got = self.module(
            """
            const {technique_panel, suggested_choice} = await page("technique_panel");
            const properties = {
                kind: {const: "fog_map"},
                fast: {type: "boolean", default: true, description: "Fast?"},
                steps: {type: "integer", minimum: 1, maximum: 64, default: 8, description: "How many.", "x-unit": "steps"},
                density: {type: "number", minimum: 0, maximum: 2.5, default: 0.5, description: "How thick."},
                mode: {type: "string", enum: ["near", "far"], default: "near", description: "Where."},
                odd: {type: "array", default: []},
            };
            const techniques = [{kind: "fog_map", summary: "Fog.", lights: ["sphere"], schema: {properties}}];
            const place = document.createElement("div"), choices = [];
            document.body.append(place);
            technique_panel(place, techniques, {kind: "fog_map", settings: {}}, {light: "point", suggested: {}}, (choice) => choices.push(choice));
            const set = (name, value, type) => {
                const control = place.querySelector(`[name=${name}]`);
                if (control.type === "checkbox") control.checked = value; else control.value = value;
                control.dispatchEvent(new Event(type));
                return choices.at(-1)?.settings;
            };
            const result = {
                names: [...place.querySelectorAll("[name]")].map((control) => control.name),
                text: place.textContent,
                ranges: place.querySelectorAll("[type=range]").length,
                fast: set("fast", false, "change"), steps: set("steps", "12", "input"), mode: set("mode", "far", "change"),
                refused: set("steps", "65", "input"), count: choices.length, back: set("fast", true, "change"),
            };
            place.remove();
            result.suggested = suggested_choice(techniques, "fog_map", {mode: "far", sides: "both", steps: 9}).settings;
            return result;
            """
        )
        self.assertEqual(got["names"], ["kind", "fast", "steps", "density", "mode"])
        for text in ("How thick.", "steps", "takes no point light; it takes: sphere", 'no control for the type "array"'):
            self.assertIn(text, got["text"])
        self.assertEqual(got["ranges"], 2)
        self.assertEqual(got["fast"], {"fast": False})
        self.assertEqual(got["steps"], {"fast": False, "steps": 12})
        self.assertEqual(got["mode"], {"fast": False, "steps": 12, "mode": "far"})
        self.assertEqual((got["refused"], got["count"]), (got["mode"], 3))  # 65 is outside: nothing was passed on
        self.assertEqual(got["suggested"], {"mode": "far"})  # of the keys that it has, enumerations
        self.assertEqual(got["back"], {"steps": 12, "mode": "far"})

    def test_a_patch_takes_out_what_is_at_its_default_again(self):
        got = self.module(
            """
            const {patch_of} = await page("client");
            const kept = {kind: "soft_shadow_map", sides: "front", bias: 2};
            const of = (technique) => patch_of({penumbra: 1, objects: [], light: {kind: "point"}, technique}, kept);
            return [of({kind: "soft_shadow_map", bias: 3}), of({kind: "ray_traced", samples: 4})];
            """
        )
        self.assertEqual(got[0], {"light": {"kind": "point"}, "technique": {"kind": "soft_shadow_map", "bias": 3, "sides": None}})
        self.assertEqual(got[1], {"light": {"kind": "point"}, "technique": {"kind": "ray_traced", "samples": 4}})

    def test_lights_shine_from_their_place_to_their_aim(self):
        got = self.module(
            """
            const [{light_json, LIGHT_KINDS}, {cross, dot, normalized}] = await Promise.all(["light", "vector"].map(page));
            const worst = {angle: 0, direction: 0};
            for (let i = 0; i < 500; i++) {
                const random = () => 20 * (Math.sin(i * 12.9898 + (worst.n = (worst.n ?? 0) + 1)) * 43758.5453 % 1) - 10;
                const position = i === 0 ? [0, 5, 0] : [random(), random(), random()], target = i === 0 ? [0, 0, 0] : [random(), random(), random()];
                const light = light_json({kind: "rectangle", position, target, width: 1e-3, length: 7, radius: 1, angular_diameter_deg: 1});
                const [u, v] = [normalized(light.half_u), normalized(light.half_v)];
                const along = normalized(target.map((value, k) => value - position[k]));
                worst.angle = Math.max(worst.angle, Math.abs(dot(u, v)));
                worst.direction = Math.max(worst.direction, 1 - dot(cross(v, u), along));
            }
            return {...worst, kinds: Object.keys(LIGHT_KINDS)};
            """
        )
        # Nine digits round each component by 5e-9 of itself, and u and v have three each.
        self.assertLess(got["angle"], 3 * 2 * 5e-9)
        self.assertLess(got["direction"], 1e-8)
        self.assertEqual(sorted(got["kinds"]), ["directional", "point", "rectangle", "sphere"])

    def test_names_of_parts_are_those_that_the_service_takes(self):
        got = self.module(
            """
            const {part_name, roles_of} = await page("files");
            const roles = (...names) => Object.fromEntries(Object.entries(roles_of(names.map((name) => new File([], name)))).map(([k, v]) => [k, v.name]));
            return {names: [part_name("my depth (1).exr", "depth", []), part_name(".hidden.exr", "depth", []), part_name("scene", "depth", []),
                            part_name("...", "depth", []), part_name("a.exr", "back", ["a.exr"]), part_name("x".repeat(300), "d", [])],
                    two: roles("floor.exr", "front.exr"), three: roles("z_back.exr", "a.exr", "b.exr"), one: roles("view.exr")};
            """
        )
        self.assertEqual(got["names"][:5], ["my_depth__1_.exr", "hidden.exr", "depth", "depth", "back_a.exr"])
        self.assertEqual(len(got["names"][5]), 128)
        self.assertEqual(got["two"], {"receiver": "floor.exr", "front": "front.exr"})
        self.assertEqual(got["three"], {"back": "z_back.exr", "front": "a.exr", "receiver": "b.exr"})
        self.assertEqual(got["one"], {"depth": "view.exr"})

    def test_the_picture_is_told_from_depth(self):
        got = self.module(
            """
            const {picture_among} = await page("files");
            const jpeg = [0xff, 0xd8, 0xff, 0xe0], exr = [0x76, 0x2f, 0x31, 0x01];
            const png = (bits, type) => [0x89, 0x50, 0x4e, 0x47, 13, 10, 26, 10, 0, 0, 0, 13, 73, 72, 68, 82, 0, 0, 0, 1, 0, 0, 0, 1, bits, type];
            const heads = {jpeg, exr, rgb: png(8, 2), rgba: png(8, 6), palette: png(4, 3), grey: png(8, 0), grey16: png(16, 0), rgb16: png(16, 2), short: [0x89]};
            const of = async (...names) => {
                const files = names.map((name) => new File([Uint8Array.from(heads[name.split(":")[0]])], name.split(":")[1] ?? name));
                try {
                    const {depth, picture, look} = await picture_among(files);
                    return [depth.map((file) => file.name).join(), picture?.name ?? "", look];
                } catch (error) { return error.message; }
            };
            return {
                jpeg: await of("jpeg", "exr"), first: await of("rgb", "grey16"), last: await of("grey", "rgba"), palette: await of("grey16", "palette"),
                deep: await of("rgb16", "grey16"), none: await of("grey16", "exr"), beside: await of("rgb", "jpeg"),
                named: await of("rgb:room.png", "rgb:room_depth.png"), turned: await of("rgb:disparity.png", "rgb:left.png"), unnamed: await of("rgb:a.png", "rgb:b.png"),
                alone: await of("jpeg"), alone_png: await of("rgb:photo.png"), depth_png: await of("rgb:photo_depth.png"), short: await of("short"),
                twice: await of("jpeg:a.jpg", "jpeg:b.jpg"),
            };
            """
        )
        jpeg, png = "JPEG", "PNG of 8-bit colours"
        self.assertEqual(got["jpeg"], ["exr", "jpeg", jpeg])
        self.assertEqual(got["first"], ["grey16", "rgb", png])
        self.assertEqual(got["last"], ["grey", "rgba", png])
        self.assertEqual(got["palette"], ["grey16", "palette", png])
        self.assertEqual(got["deep"], ["rgb16,grey16", "", ""])
        self.assertEqual(got["none"], ["grey16,exr", "", ""])
        self.assertEqual(got["beside"], ["rgb", "jpeg", jpeg])
        self.assertEqual(got["named"], ["room_depth.png", "room.png", png])
        self.assertEqual(got["turned"], ["disparity.png", "left.png", png])
        self.assertEqual(got["unnamed"], ["a.png", "b.png", png])
        self.assertEqual(got["alone"], ["", "jpeg", jpeg])
        self.assertEqual(got["alone_png"], ["", "photo.png", png])
        self.assertEqual(got["depth_png"], ["photo_depth.png", "", ""])
        self.assertEqual(got["short"], ["short", "", ""])
        self.assertIn("a.jpg and b.jpg are pictures", got["twice"])

    def test_a_picture_is_multiplied_in_linear_light(self):
        # Every code under every share of the light: one pixel each.
        got = self.module(
            """
            const {Picture} = await page("picture");
            const codes = Array.from({length: 256}, (_, i) => i), shares = [0, 1e-4, 0.003, 0.1, 0.5, 0.9, 1];
            const canvas = new OffscreenCanvas(256, shares.length), context = canvas.getContext("2d"), image = context.createImageData(256, shares.length);
            for (let i = 0; i < image.data.length; i++) image.data[i] = i % 4 === 3 ? 255 : (i >> 2) % 256;
            context.putImageData(image, 0, 0);
            const picture = new Picture("codes.png", canvas.transferToImageBitmap());
            const pixels = Float32Array.from({length: 256 * shares.length}, (_, i) => shares[i >> 8]);
            const grey = {width: 256, height: shares.length, channels: 1, pixels};
            const coloured = {...grey, channels: 3, pixels: Float32Array.from({length: 3 * pixels.length}, (_, i) => (i % 3 === 1 ? pixels[(i - 1) / 3] : 0))};
            const fits = (width, height) => picture.fits({width, height});
            return {shares, grey: [...picture.under(grey).data], coloured: [...picture.under(coloured).data].slice(-4),
                    fits: [fits(512, 14), fits(258, 7), fits(260, 7)], said: picture.said_of({width: 300, height: 300})};
            """
        )
        linear = lambda v: v / 12.92 if v <= 0.04045 else ((v + 0.055) / 1.055) ** 2.4
        encoded = lambda v: 12.92 * v if v <= 0.0031308 else 1.055 * v ** (1 / 2.4) - 0.055
        for row, share in enumerate(got["shares"]):
            for code in range(256):
                pixel = got["grey"][4 * (256 * row + code):][:4]
                expected = 255 * encoded(linear(code / 255) * share)
                # The table's steps of linear light move by a twentieth of a code at most.
                self.assertLess(abs(pixel[0] - expected), 0.56, (code, share))
                self.assertEqual(pixel, [pixel[0]] * 3 + [255])
        self.assertEqual(got["coloured"], [0, 255, 0, 255])  # each channel has its own share
        self.assertEqual(got["fits"], [True, True, False])
        for part in ("codes.png is 256 x 7", "300 x 300", "1 %"):
            self.assertIn(part, got["said"])

    def test_drafts_are_techniques_that_take_the_light(self):
        got = self.module(
            """
            const {draft_of} = await page("technique_panel");
            const one = (kind, lights) => ({kind, lights, schema: {properties: {sides: {enum: ["front", "both"], default: "both"}}}});
            const techniques = [one("depth_trace", ["sphere"]), one("soft_shadow_map", ["rectangle"]), one("shadow_map", ["rectangle", "sphere"])];
            const source = {drafts: ["soft_shadow_map", "shadow_map"], suggested: {sides: "front"}};
            const of = (kind, light, from = source) => draft_of(techniques, {kind, settings: {}}, from, light);
            return [of("depth_trace", "rectangle"), of("depth_trace", "sphere"), of("depth_trace", "point"), of("soft_shadow_map", "rectangle"),
                    of("depth_trace", "rectangle", {...source, drafts: []})];
            """
        )
        self.assertEqual(got, [{"kind": "soft_shadow_map", "settings": {"sides": "front"}}, {"kind": "shadow_map", "settings": {"sides": "front"}}, None, None, None])

    def test_a_scene_is_kept_once_for_all_who_ask(self):
        got = self.module(
            """
            const [{Client}, scenes] = await Promise.all(["client", "scene"].map(page));
            const source = scenes.courtyard_source(), client = new Client();
            const ask = (kind) => client.mask(scenes.scene_json(source, source.light, {kind, settings: {}}), source.files, "image/x-portable-floatmap");
            const posted = () => performance.getEntriesByType("resource").filter((entry) => entry.name.endsWith("/v1/scenes")).length;
            const before = posted();
            await Promise.all([ask("shadow_map"), ask("soft_shadow_map")]);
            return posted() - before;
            """
        )
        self.assertEqual(got, 1)


if __name__ == "__main__":
    unittest.main(verbosity=2)
