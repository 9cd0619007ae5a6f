"""The page's modules on their own: float maps, error figures, the queue, controls from a schema, the light."""

import base64
import json
import math
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
                const light = light_json({kind: "rectangle", position, target, width: 1e-3, height: 7, radius: 1, angular_diameter_deg: 1});
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
            const {part_name, roles_of} = await page("source_panel");
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


if __name__ == "__main__":
    unittest.main(verbosity=2)
